#include "zones/timed.h"

#include <stdlib.h>
#include <string.h>

enum { CHECK_EVERY = 256 }; /* pairs between two calls of `keep_on` */

/* --- making one --------------------------------------------------------------------------------- */

bool fsm_timed_init(fsm_timed *self, fsm_composition *composition, size_t memory_limit)
{
    const fsm_system *system = composition->system;
    size_t marks = (size_t)composition->model.mark_count + 1;
    *self = (fsm_timed){.composition = composition, .memory_limit = memory_limit,
                        .unit = system->unit > 0 ? (int32_t)system->unit : 1};
    self->pair_room = self->family_room = 64;
    self->pairs = malloc(self->pair_room * sizeof *self->pairs);
    self->families = malloc(self->family_room * sizeof *self->families);
    self->witnesses = malloc(marks * sizeof *self->witnesses);
    self->marks = malloc((FSM_MOST_NOTES + FSM_MOST_MACHINES) * sizeof *self->marks);
    self->evaluated = malloc(marks * sizeof *self->evaluated);
    self->before = malloc(FSM_ZONE_ROOM * sizeof *self->before);
    self->guarded = malloc(FSM_ZONE_ROOM * sizeof *self->guarded);
    self->after = malloc(FSM_ZONE_ROOM * sizeof *self->after);
    self->upper = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->upper);
    self->limits = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->limits);
    self->next_limits = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->next_limits);
    self->source = malloc((FSM_MOST_CLOCKS + 1) * sizeof *self->source);
    bool fine = fsm_store_init(&self->tuples, (system->machine_count + 1u) * sizeof(uint32_t));
    fine = fsm_zones_init(&self->zones) && fine;
    if (!fine || self->pairs == NULL || self->families == NULL || self->witnesses == NULL
        || self->marks == NULL || self->evaluated == NULL || self->before == NULL || self->guarded == NULL || self->after == NULL
        || self->upper == NULL || self->limits == NULL || self->next_limits == NULL || self->source == NULL) {
        fsm_timed_free(self);
        return false;
    }
    for (size_t i = 0; i < marks; i++)
        self->witnesses[i] = (fsm_timed_witness){FSM_NONE, FSM_NONE, 0};
    return true;
}

void fsm_timed_free(fsm_timed *self)
{
    for (uint32_t tuple = 0; tuple < self->tuples.count; tuple++)
        free(self->families[tuple].entries);
    fsm_store_free(&self->tuples);
    fsm_zones_free(&self->zones);
    fsm_hash_map_free(&self->fires);
    free(self->pairs);
    free(self->families);
    free(self->witnesses);
    free(self->marks);
    free(self->evaluated);
    free(self->before);
    free(self->guarded);
    free(self->after);
    free(self->upper);
    free(self->limits);
    free(self->next_limits);
    free(self->source);
    *self = (fsm_timed){0};
}

size_t fsm_timed_bytes(const fsm_timed *self)
{
    return fsm_store_bytes(&self->tuples) + self->zones.bytes + self->pair_room * sizeof *self->pairs
        + self->family_room * sizeof *self->families
        + self->entry_room * sizeof(fsm_entry) + fsm_hash_map_bytes(&self->fires)
        + fsm_composition_bytes(self->composition);
}

/* --- the search ------------------------------------------------------------------------------------- */

static void note_mark(fsm_timed *self, uint32_t mark, uint32_t pair, uint32_t step)
{
    fsm_timed_witness *witness = &self->witnesses[mark];
    if (witness->count++ == 0) {
        if (self->awaited != NULL && self->awaited[mark])
            self->awaited_count -= self->awaited_count > 0;
        witness->state = pair;
        witness->step = step;
    }
}

static bool out_of_memory(fsm_timed *self)
{
    self->outcome = FSM_OUT_OF_MEMORY;
    return false;
}

/* The bytes that a part of `bytes` may grow to, by the use at the last check. */
static size_t limit_for(const fsm_timed *self, size_t bytes)
{
    return bytes + (self->memory_limit > self->bytes ? self->memory_limit - self->bytes : 0);
}

static bool make_room(fsm_timed *self)
{
    if (self->pair_count == self->pair_room) {
        size_t room = 2 * (size_t)self->pair_room, bytes = room * sizeof *self->pairs;
        fsm_pair *pairs = room >= FSM_NONE || bytes > limit_for(self, bytes / 2) ? NULL : realloc(self->pairs, bytes);
        if (pairs == NULL)
            return false;
        self->pairs = pairs;
        self->pair_room = (uint32_t)room;
    }
    if (self->tuples.count >= self->family_room) {
        size_t room = 2 * (size_t)self->family_room;
        fsm_family *families = room >= FSM_NONE ? NULL : realloc(self->families, room * sizeof *families);
        if (families == NULL)
            return false;
        self->families = families;
        self->family_room = (uint32_t)room;
    }
    return true;
}

/* The watch may show more than it is compared with, so that no summary is conclusive. */
static fsm_zone_summary summary_of(const fsm_timed *self, const fsm_limits *limits)
{
    return self->watch.present ? (fsm_zone_summary){0, 0} : fsm_zones_summary(&self->zones, limits);
}

/* A stored pair that covers the current zone; FSM_NONE: no pair does. */
static uint32_t find_cover(const fsm_timed *self, uint32_t tuple, fsm_zone_summary summary, const fsm_limits *limits)
{
    const fsm_family *family = &self->families[tuple];
    uint32_t same = family->count > 0 ? fsm_zones_find(&self->zones) : FSM_NONE;
    for (uint32_t i = 0; i < family->count; i++) {
        const fsm_entry *entry = &family->entries[i];
        if (entry->zone == same || (fsm_may_cover(entry->summary, summary) && fsm_zones_covers(&self->zones, entry->zone, limits)))
            return entry->pair;
    }
    return FSM_NONE;
}

/* Removes the pairs that the current zone covers. One whose turn is in the current layer still has
 * it, so that paths stay shortest. */
static void displace(fsm_timed *self, uint32_t tuple, fsm_zone_summary summary, const fsm_limits *limits)
{
    fsm_family *family = &self->families[tuple];
    uint32_t left = 0;
    for (uint32_t i = 0; i < family->count; i++) {
        fsm_entry entry = family->entries[i];
        if (fsm_may_cover(summary, entry.summary) && fsm_zones_is_covered(&self->zones, entry.zone, limits))
            self->pairs[entry.pair].covered = entry.pair >= self->layer_end;
        else
            family->entries[left++] = entry;
    }
    self->kept -= family->count - left;
    family->count = left;
}

bool fsm_family_add(fsm_family *family, fsm_entry entry, size_t *all_room)
{
    if (family->count == family->room) {
        uint32_t room = family->room == 0 ? 1 : 2 * family->room;
        fsm_entry *entries = realloc(family->entries, room * sizeof *entries);
        if (entries == NULL)
            return false;
        *all_room += room - family->room;
        family->entries = entries;
        family->room = room;
    }
    family->entries[family->count++] = entry;
    return true;
}

static void read_watch(fsm_timed *self, const fsm_timed_step *step)
{
    fsm_watch *watch = &self->watch;
    if (step->stops) {
        watch->least = !watch->stopped || step->arrival_least > watch->least ? step->arrival_least : watch->least;
        watch->greatest = !watch->stopped || step->arrival_most > watch->greatest ? step->arrival_most : watch->greatest;
        watch->stopped = true;
    }
    if (fsm_timed_watches(self, step->tuple)) {
        fsm_bound most = step->zone[(size_t)(step->size - 1) * step->size];
        watch->pending = most > watch->pending ? most : watch->pending;
    }
}

static bool add_pair(fsm_timed *self, uint32_t tuple, bool new_tuple, fsm_zone_summary summary, const fsm_timed_step *step)
{
    uint32_t number = self->pair_count;
    uint32_t zone = fsm_zones_keep(&self->zones, limit_for(self, self->zones.bytes));
    if (zone == FSM_NONE || !fsm_family_add(&self->families[tuple], (fsm_entry){summary, zone, number}, &self->entry_room))
        return out_of_memory(self);
    self->pairs[number] = (fsm_pair){tuple, zone, {self->next, self->step}, false};
    self->pair_count++;
    self->kept++;
    if (!new_tuple)
        return true;
    uint32_t count = fsm_flat_marks(self->composition, step->tuple, self->evaluated);
    for (uint32_t i = 0; i < count; i++)
        note_mark(self, self->evaluated[i], number, FSM_NONE);
    return true;
}

static bool visit(void *context, const fsm_timed_step *step)
{
    fsm_timed *self = context;
    bool added;
    if (!make_room(self))
        return out_of_memory(self);
    uint32_t tuple = fsm_store_insert(&self->tuples, step->tuple, limit_for(self, fsm_store_bytes(&self->tuples)), &added);
    if (tuple == FSM_NONE || !fsm_zones_hold(&self->zones, step->zone, step->size))
        return out_of_memory(self);
    if (added)
        self->families[tuple] = (fsm_family){NULL, 0, 0};
    for (uint32_t i = 0; i < step->mark_count; i++)
        note_mark(self, step->marks[i], self->next, self->step);
    if (self->watch.present)
        read_watch(self, step);
    fsm_zone_summary summary = summary_of(self, step->limits);
    if (find_cover(self, tuple, summary, step->limits) == FSM_NONE) {
        displace(self, tuple, summary, step->limits);
        if (!add_pair(self, tuple, added, summary, step))
            return false;
    }
    if (self->next != FSM_NONE && step->kind == FSM_STEP_INTERNAL && (!step->fires || step->instant)
        && tuple <= self->pairs[self->next].tuple)
        self->internal_back_edge = true;
    self->transitions += self->next != FSM_NONE;
    self->step++;
    return true;
}

static bool may_go_on(fsm_timed *self)
{
    if (self->next == self->layer_end) {
        self->layer_end = self->pair_count;
        self->depth++;
    }
    if (self->next % CHECK_EVERY != 0)
        return true;
    self->bytes = fsm_timed_bytes(self);
    return self->keep_on == NULL || self->keep_on(self);
}

static bool expand(fsm_timed *self)
{
    const fsm_pair *pair = &self->pairs[self->next];
    size_t bytes = (fsm_timed_machines(self) + 1u) * sizeof *self->current;
    if (pair->covered)
        return true;
    memcpy(self->current, fsm_store_at(&self->tuples, pair->tuple), bytes);
    fsm_zones_read(&self->zones, pair->zone, fsm_timed_size(self, self->current), self->before);
    self->step = 0;
    return fsm_timed_successors(self, self->current, self->before, false, visit, self);
}

void fsm_timed_run(fsm_timed *self)
{
    self->outcome = FSM_COMPLETE;
    self->next = FSM_NONE;
    bool whole = fsm_timed_initial(self, visit, self);
    self->layer_end = self->pair_count;
    for (self->next = 0; whole && self->next < self->pair_count; self->next++) {
        if (!may_go_on(self))
            return;
        whole = expand(self);
        if (whole && self->awaited != NULL && self->awaited_count == 0) {
            self->outcome = FSM_DECIDED;
            self->next++;
            return;
        }
    }
    if (!whole && self->outcome == FSM_COMPLETE)
        self->outcome = FSM_MODEL_FAILED;
}

uint32_t fsm_timed_find(fsm_timed *self, const fsm_timed_step *step)
{
    uint32_t tuple = fsm_store_find(&self->tuples, step->tuple);
    if (tuple == FSM_NONE || !fsm_zones_hold(&self->zones, step->zone, step->size))
        return FSM_NONE;
    return find_cover(self, tuple, summary_of(self, step->limits), step->limits);
}

uint32_t fsm_timed_path(const fsm_timed *self, uint32_t pair, uint32_t *path)
{
    uint32_t length = 0;
    for (uint32_t at = pair; at != FSM_NONE; at = self->pairs[at].origin.from)
        length++;
    if (path != NULL)
        for (uint32_t at = pair, i = length; at != FSM_NONE; at = self->pairs[at].origin.from)
            path[--i] = self->pairs[at].origin.step;
    return length;
}
