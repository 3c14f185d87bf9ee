/* What a rank has found, in files of its own: a log that only grows, of states, local states, states of groups and footprints
 * in the order of their numbers; and, each time that all ranks are between two layers, what else it takes to go on from there.
 * The file `commit` says up to which layer all ranks have done so; what lies beyond that is not read. */
#define _POSIX_C_SOURCE 200809L
#include "mpi/ranks.h"

#include <inttypes.h>
#include <stdio.h>
#include <unistd.h>

typedef enum { STATES, LOCALS, NODES, FOOTPRINTS } kind;

enum { NAME = 4096, CHUNK = 1 << 16 };

struct fsm_saved {
    FILE *log;
    uint64_t length;     /* bytes of the log */
    uint32_t *counts;    /* the numbers already in the log: local states by machine, then states by node, then footprints */
    uint32_t committed;  /* the layer that was committed last; FSM_NONE: none */
};

static bool failed(fsm_ranks *self)
{
    (void)fsm_fail(self->composition, "checkpoints cannot be written or read");
    return fsm_ranks_stop(self, FSM_MODEL_FAILED);
}

static FILE *open_file(const fsm_ranks *self, const char *mode, const char *what, uint32_t number)
{
    char name[NAME];
    int length = number == FSM_NONE
        ? snprintf(name, sizeof name, "%s/rank-%" PRIu32 ".%s", self->options.folder, self->rank, what)
        : snprintf(name, sizeof name, "%s/rank-%" PRIu32 ".%s-%" PRIu32, self->options.folder, self->rank, what, number);
    return length < 0 || (size_t)length >= sizeof name ? NULL : fopen(name, mode);
}

static bool append(struct fsm_saved *self, const void *bytes, size_t count)
{
    self->length += count;
    return fwrite(bytes, 1, count, self->log) == count;
}

static bool append_head(struct fsm_saved *self, kind what, uint32_t of, uint64_t count)
{
    const uint64_t head[3] = {(uint64_t)what, of, count};
    return append(self, head, sizeof head);
}

/* Everything up to here is on the disk. */
static bool settle(FILE *file)
{
    return fflush(file) == 0 && fsync(fileno(file)) == 0;
}

/* --- saving ------------------------------------------------------------------------------------------------- */

bool fsm_saved_layer(fsm_ranks *self, const fsm_members *layer)
{
    struct fsm_saved *saved = self->saved;
    if (saved == NULL)
        return true;
    bool fine = append_head(saved, STATES, 0, layer->count);
    for (size_t i = 0; fine && i < layer->count; i++)
        fine = append(saved, &fsm_members_of(layer)[i].state, sizeof(fsm_state));
    return fine || failed(self);
}

static bool append_numbers(fsm_ranks *self)
{
    struct fsm_saved *saved = self->saved;
    const fsm_composition *c = self->composition;
    const fsm_tree *tree = c->tree;
    uint32_t machines = c->system->machine_count, *counts = saved->counts;
    bool fine = true;
    for (uint32_t m = 0; fine && m < machines; m++) {
        uint32_t count = c->locals[m].count;
        fine = append_head(saved, LOCALS, m, count - counts[m]);
        for (; fine && counts[m] < count; counts[m]++)
            fine = append(saved, fsm_store_at(&c->locals[m], counts[m]), c->locals[m].state_size);
    }
    for (uint32_t n = tree->node_count; fine && n-- > 0;) { /* a node comes before its children in the tree */
        uint32_t count = tree->nodes[n].count, *known = &counts[machines + n];
        fine = append_head(saved, NODES, n, count - *known);
        for (; fine && *known < count; (*known)++) {
            const fsm_node_state *at = fsm_node_at(&tree->nodes[n], *known);
            const uint32_t pair[2] = {at->left, at->right};
            fine = append(saved, pair, sizeof pair);
        }
    }
    const fsm_store *footprints = &tree->sleep.footprints;
    uint32_t count = footprints->count, *known = &counts[machines + tree->node_count];
    fine = fine && append_head(saved, FOOTPRINTS, 0, count - *known);
    for (; fine && *known < count; (*known)++)
        fine = append(saved, fsm_store_at(footprints, *known), footprints->state_size);
    return fine && settle(saved->log);
}

static void write_members(const fsm_member *members, size_t count, fsm_wire *wire)
{
    fsm_wire_number(wire, count);
    fsm_wire_bytes(wire, members, count * sizeof *members);
}

static void write_rest(const fsm_ranks *self, const fsm_members *layer, fsm_wire *wire)
{
    const fsm_composition *c = self->composition;
    const uint64_t numbers[] = {self->saved->length, self->depth, self->interval, self->stop_count, self->expanded,
                                self->transitions, self->sent_states, self->filtered, self->maybe_cyclic, self->all_states,
                                self->all_transitions};
    fsm_wire_bytes(wire, numbers, sizeof numbers);
    write_members(fsm_members_of(layer), layer->count, wire);
    for (uint32_t i = 0; i < self->stop_count; i++) {
        fsm_wire_number(wire, self->stops[i].depth);
        write_members(self->stops[i].members, self->stops[i].count, wire);
    }
    fsm_wire_bytes(wire, self->sights, self->model->mark_count * sizeof *self->sights);
    for (uint32_t m = 0; m < c->system->machine_count; m++) {
        fsm_wire_number(wire, c->bounds[m].microsteps);
        fsm_wire_bytes(wire, c->states_seen[m], c->system->machines[m]->info->state_count);
        fsm_wire_bytes(wire, c->transitions_seen[m], c->system->machines[m]->info->transition_count);
    }
}

static void remove_rest(const fsm_ranks *self, uint32_t depth)
{
    char name[NAME];
    if (depth != FSM_NONE
        && snprintf(name, sizeof name, "%s/rank-%" PRIu32 ".layer-%" PRIu32, self->options.folder, self->rank, depth) < NAME)
        (void)remove(name);
}

/* Rank 0 says that all ranks have saved a layer; under its name once it is whole. */
static bool publish(const fsm_ranks *self)
{
    char name[NAME], made[NAME];
    if (self->rank != 0)
        return true;
    if (snprintf(name, sizeof name, "%s/commit", self->options.folder) >= NAME
        || snprintf(made, sizeof made, "%s/commit.new", self->options.folder) >= NAME)
        return false;
    FILE *file = fopen(made, "w");
    bool fine = file != NULL
        && fprintf(file, "{\"identity\": \"%s\", \"ranks\": %" PRIu32 ", \"depth\": %" PRIu32 ", \"states\": %" PRIu64 "}\n",
                   self->options.identity, self->ranks, self->depth, self->all_states) > 0
        && settle(file);
    fine = file != NULL && fclose(file) == 0 && fine;
    return fine && rename(made, name) == 0;
}

bool fsm_saved_commit(fsm_ranks *self, fsm_members *layer)
{
    struct fsm_saved *saved = self->saved;
    if (saved == NULL)
        return true;
    fsm_wire rest = {0};
    bool fine = append_numbers(self);
    write_rest(self, layer, &rest);
    FILE *file = fine && !rest.failed ? open_file(self, "wb", "layer", self->depth) : NULL;
    fine = file != NULL && fwrite(rest.bytes, 1, rest.count, file) == rest.count && settle(file);
    fine = file != NULL && fclose(file) == 0 && fine;
    fsm_wire_free(&rest);
    if (!fine)
        (void)failed(self);
    if (fsm_ranks_agree(self) != FSM_COMPLETE)
        return false;
    if (!publish(self))
        (void)failed(self);
    if (fsm_ranks_agree(self) != FSM_COMPLETE)
        return false;
    remove_rest(self, saved->committed);
    saved->committed = self->depth;
    return true;
}

/* --- reading ------------------------------------------------------------------------------------------------ */

static bool read_some(FILE *file, void *bytes, size_t count)
{
    return fread(bytes, 1, count, file) == count;
}

static bool read_one(fsm_ranks *self, kind what, uint32_t of)
{
    fsm_composition *c = self->composition;
    FILE *log = self->saved->log;
    fsm_footprint footprint;
    uint32_t pair[2];
    fsm_state state;
    switch (what) {
    case STATES:
        return read_some(log, &state, sizeof state) && fsm_set_put(&self->passed, state) == FSM_ADDED;
    case LOCALS:
        return of < c->system->machine_count && read_some(log, c->after, c->locals[of].state_size)
            && fsm_intern(c, of, c->after) == self->saved->counts[of]++;
    case NODES:
        return of < c->tree->node_count && read_some(log, pair, sizeof pair)
            && fsm_node_number(c->tree, &c->tree->nodes[of], pair[0], pair[1]) != FSM_NONE
            && ++self->saved->counts[c->system->machine_count + of] <= c->tree->nodes[of].count;
    case FOOTPRINTS:
        break;
    }
    uint32_t *count = &self->saved->counts[c->system->machine_count + c->tree->node_count];
    return read_some(log, &footprint, sizeof footprint) && fsm_sleep_sets_number(&c->tree->sleep, &footprint) == (*count)++;
}

static bool read_log(fsm_ranks *self, uint64_t length)
{
    FILE *log = self->saved->log;
    bool fine = true;
    while (fine && (uint64_t)ftell(log) < length) {
        uint64_t head[3];
        fine = read_some(log, head, sizeof head);
        for (uint64_t i = 0; fine && i < head[2]; i++)
            fine = read_one(self, (kind)head[0], (uint32_t)head[1]);
    }
    self->saved->length = length;
    return fine && (uint64_t)ftell(log) == length && ftruncate(fileno(log), (off_t)length) == 0
        && fseek(log, 0, SEEK_END) == 0;
}

static bool read_members(fsm_unread *from, fsm_members *members)
{
    size_t count = (size_t)fsm_read_number(from);
    const void *bytes = fsm_read_bytes(from, count * sizeof(fsm_member));
    if (bytes == NULL || count * sizeof(fsm_member) > members->region.reserved)
        return false;
    memcpy(members->region.base, bytes, count * sizeof(fsm_member));
    members->count = members->seen = count;
    return true;
}

static bool read_stops(fsm_ranks *self, uint64_t count, fsm_unread *from)
{
    fsm_members *spare = &self->layers[(self->depth + 1) % 2];
    uint32_t depth = self->depth;
    bool fine = true;
    for (uint64_t i = 0; fine && i < count; i++) {
        self->depth = fsm_read_small(from);
        fine = read_members(from, spare) && fsm_stops_keep(self, spare);
    }
    self->depth = depth;
    spare->count = spare->seen = 0;
    return fine;
}

static bool read_rest(fsm_ranks *self, fsm_unread *from)
{
    fsm_composition *c = self->composition;
    uint64_t n[11];
    const void *numbers = fsm_read_bytes(from, sizeof n);
    if (numbers == NULL)
        return false;
    memcpy(n, numbers, sizeof n);
    self->depth = (uint32_t)n[1];
    self->interval = (uint32_t)n[2];
    self->expanded = n[4];
    self->transitions = n[5];
    self->sent_states = n[6];
    self->filtered = n[7];
    self->maybe_cyclic = n[8] != 0;
    self->all_states = n[9];
    self->all_transitions = n[10];
    size_t marks = self->model->mark_count * sizeof *self->sights;
    bool fine = read_members(from, &self->layers[self->depth % 2]) && read_stops(self, n[3], from);
    const void *sights = fsm_read_bytes(from, marks);
    if (fine && sights != NULL)
        memcpy(self->sights, sights, marks);
    for (uint32_t m = 0; fine && m < c->system->machine_count; m++) {
        const fsm_machine_info *info = c->system->machines[m]->info;
        c->bounds[m].microsteps = fsm_read_small(from);
        const void *states = fsm_read_bytes(from, info->state_count);
        const void *transitions = fsm_read_bytes(from, info->transition_count);
        fine = states != NULL && transitions != NULL;
        if (fine) {
            memcpy(c->states_seen[m], states, info->state_count);
            memcpy(c->transitions_seen[m], transitions, info->transition_count);
        }
    }
    return fine && !from->failed && read_log(self, n[0]);
}

static bool read_whole(FILE *file, fsm_wire *wire)
{
    size_t some = CHUNK;
    while (some == CHUNK && fsm_wire_make_room(wire, CHUNK)) {
        some = fread(wire->bytes + wire->count, 1, CHUNK, file);
        wire->count += some;
    }
    return !wire->failed && ferror(file) == 0;
}

/* The layer that is committed; FSM_NONE: none. */
static uint32_t committed(const fsm_ranks *self)
{
    char name[NAME];
    uint32_t depth = FSM_NONE;
    FILE *file = snprintf(name, sizeof name, "%s/commit", self->options.folder) < NAME ? fopen(name, "r") : NULL;
    if (file != NULL && fscanf(file, "{\"identity\": \"%*[^\"]\", \"ranks\": %*u, \"depth\": %" SCNu32, &depth) != 1)
        depth = FSM_NONE;
    if (file != NULL)
        (void)fclose(file);
    return depth;
}

bool fsm_saved_open(fsm_ranks *self, uint32_t *depth)
{
    *depth = FSM_NONE;
    if (self->options.folder == NULL)
        return true;
    if (self->rank == 0)
        *depth = committed(self);
    MPI_Bcast(depth, 1, MPI_UINT32_T, 0, MPI_COMM_WORLD);
    const fsm_composition *c = self->composition;
    struct fsm_saved *saved = calloc(1, sizeof *saved);
    uint32_t *counts = calloc((size_t)c->system->machine_count + c->tree->node_count + 1, sizeof *counts);
    FILE *log = open_file(self, *depth == FSM_NONE ? "w+b" : "r+b", "log", FSM_NONE);
    if (saved == NULL || counts == NULL || log == NULL) {
        free(saved);
        free(counts);
        return failed(self);
    }
    *saved = (struct fsm_saved){log, 0, counts, *depth};
    self->saved = saved;
    counts[c->system->machine_count + c->tree->node_count] = 1; /* the first footprint is always there */
    if (*depth == FSM_NONE)
        return true;
    FILE *file = open_file(self, "rb", "layer", *depth);
    fsm_wire rest = {0};
    bool fine = file != NULL && read_whole(file, &rest);
    fsm_unread from = {rest.bytes, rest.bytes + rest.count, false};
    fine = fine && read_rest(self, &from);
    if (file != NULL)
        (void)fclose(file);
    fsm_wire_free(&rest);
    return fine || failed(self);
}

void fsm_saved_close(fsm_ranks *self, bool is_over)
{
    char name[NAME];
    if (self->saved == NULL)
        return;
    (void)fclose(self->saved->log);
    if (is_over) {
        for (uint32_t depth = 0; depth <= self->depth; depth++) /* also those of a run that was killed */
            remove_rest(self, depth);
        if (snprintf(name, sizeof name, "%s/rank-%" PRIu32 ".log", self->options.folder, self->rank) < NAME)
            (void)remove(name);
        if (self->rank == 0 && snprintf(name, sizeof name, "%s/commit", self->options.folder) < NAME)
            (void)remove(name);
    }
    free(self->saved->counts);
    free(self->saved);
    self->saved = NULL;
}
