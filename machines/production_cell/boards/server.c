#include "server.h"

#include "faults.h"
#include "text.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

enum { PROTOCOL = 1, CONNECT_MS = 5000, AWAIT_MS = 5000, LONGEST_JSON = 512 };

static const char *const fault_names[] = BOARD_FAULT_NAMES;

/* ---- replies ----------------------------------------------------------------------------------- */

static void begin(server *self, char kind)
{
    self->reply[0] = (uint8_t)kind;
    self->length = 1u;
}

static void refuse(server *self, const char *why)
{
    const size_t length = strlen(why);
    begin(self, 'E');
    memcpy(self->reply + 1, why, length);
    self->length += length;
}

static text begin_text(server *self, char kind)
{
    text json = {NULL, SERVER_ROOM - 1u, 0u, false};
    begin(self, kind);
    json.at = (char *)self->reply + 1;
    return json;
}

static void end_text(server *self, const text *json)
{
    if (json->is_full)
        refuse(self, "the reply is too long");
    else
        self->length = 1u + json->length;
}

static void put(server *self, uint32_t value)
{
    fsm_link_put_bytes(self->reply + self->length, value, 4u);
    self->length += 4u;
}

static size_t input_count(void)
{
    size_t count = 0u;
    while (count < board_this.wire_count && !fsm_io_is_output(&board_this.wires[count]))
        count++;
    return count;
}

/* The wires, then of each machine its state and its fault. */
static void put_outputs(server *self)
{
    for (size_t i = input_count(); i < board_this.wire_count; i++)
        put(self, (uint32_t)*fsm_io_at(board_this.raw, &board_this.wires[i]));
    for (size_t i = 0; i < board_this.machine_count; i++) {
        put(self, board_this.machines[i].leaf());
        put(self, board_this.machines[i].fault());
    }
}

void server_read_map(const server *self)
{
    if (self->map != NULL)
        fsm_io_map_read(self->map, board_this.raw);
}

void server_write_map(const server *self)
{
    if (self->map != NULL)
        fsm_io_map_write(self->map, board_this.raw);
}

static void take_inputs(const server *self, const uint8_t *bytes)
{
    const size_t count = self->map == NULL ? input_count() : 0u;
    server_read_map(self);
    for (size_t i = 0; i < count; i++)
        *fsm_io_at(board_this.raw, &board_this.wires[i]) =
            (int32_t)fsm_link_get_signed(bytes + 4u * i, 4u);
}

/* ---- connect, check, report ------------------------------------------------------------------------ */

static void add_signal(text *json, bool is_first, const char *name, const char *rest)
{
    text_add(json, "%s{\"name\": \"%s%s\", \"type\": \"i32\"}", is_first ? "" : ", ", name, rest);
}

static void add_signals(text *json)
{
    const size_t inputs = input_count();
    text_add(json, ", \"inputs\": [");
    for (size_t i = 0; i < inputs; i++)
        add_signal(json, i == 0u, board_this.wires[i].name, "");
    text_add(json, "], \"outputs\": [");
    for (size_t i = inputs; i < board_this.wire_count; i++)
        add_signal(json, i == inputs, board_this.wires[i].name, "");
    for (size_t i = 0; i < board_this.machine_count; i++) {
        add_signal(json, false, board_this.machines[i].name, ".state");
        add_signal(json, false, board_this.machines[i].name, ".fault");
    }
    text_add(json, "]");
}

static void add_states(text *json)
{
    text_add(json, ", \"states\": {");
    for (size_t i = 0; i < board_this.machine_count; i++) {
        const board_machine *const m = &board_this.machines[i];
        text_add(json, "%s\"%s\": [", i > 0 ? ", " : "", m->name);
        for (uint16_t state = 0; state < m->states; state++) {
            const char *const name = m->state_name(state);
            text_add(json, "%s", state > 0 ? ", " : "");
            text_add_string(json, name != NULL ? name : "");
        }
        text_add(json, "]");
    }
    text_add(json, "}");
}

static void add_peers(text *json)
{
    bool is_first = true;
    text_add(json, ", \"peers\": [");
    for (uint8_t node = 0; node < board_this.map->nodes; node++) {
        if (node == board_this.map->node)
            continue;
        text_add(json, "%s\"%s\"", is_first ? "" : ", ", board_this.map->names[node]);
        is_first = false;
    }
    text_add(json, "]");
}

static void connect(server *self, const char *asked)
{
    text json;
    double protocol = 0.0;
    if (!text_number_of(asked, "protocol", &protocol) || protocol < PROTOCOL ||
        protocol > PROTOCOL) {
        refuse(self, "this board speaks protocol 1");
        return;
    }
    json = begin_text(self, 'C');
    text_add(&json, "{\"protocol\": %d, \"name\": \"%s\", \"period_us\": 1000", PROTOCOL,
             board_this.name);
    text_add(&json, ", \"map\": \"%08" PRIx32 "\"", board_this.map->hash);
    add_signals(&json);
    add_peers(&json);
    text_add(&json, ", \"machines\": [");
    for (size_t i = 0; i < board_this.machine_count; i++)
        text_add(&json, "%s\"%s\"", i > 0 ? ", " : "", board_this.machines[i].name);
    text_add(&json, "]");
    add_states(&json);
    text_add(&json, "}");
    end_text(self, &json);
}

/* In co-simulation the other boards must listen before the first step. */
static void check(server *self)
{
    text json;
    char why[160];
    fsm_link_waited waited = FSM_LINK_READY;
    if (self->is_linked && self->host == NULL)
        waited = fsm_link_connect(&self->link, CONNECT_MS);
    json = begin_text(self, 'K');
    if (waited == FSM_LINK_READY) {
        text_add(&json, "{\"ok\": true}");
    } else {
        fsm_link_explain(&self->link, why, sizeof why);
        text_add(&json, "{\"ok\": false, \"why\": ");
        text_add_string(&json, why);
        text_add(&json, "}");
    }
    end_text(self, &json);
}

static unsigned refused(const server *self)
{
    unsigned sum = board_this.lost() + fsm_link_counted(&self->link, FSM_LINK_REFUSED);
    for (size_t i = 0; i < board_this.machine_count; i++)
        sum += board_this.machines[i].refused();
    return sum;
}

bool server_status(const server *self, char *line, size_t room)
{
    const board *const b = &self->board;
    const board_machine *faulty = NULL;
    for (uint8_t peer = 0; self->is_linked && peer < board_this.map->nodes; peer++)
        if (peer != board_this.map->node && fsm_link_session(&self->link, peer) == 0u) {
            (void)snprintf(line, room, "waits for board %s", board_this.map->names[peer]);
            return false;
        }
    for (size_t i = 0; i < board_this.machine_count && faulty == NULL; i++)
        if (board_this.machines[i].fault() != 0u)
            faulty = &board_this.machines[i];
    if (faulty != NULL)
        (void)snprintf(line, room, "fault of %s", faulty->name);
    else if (b->is_off && b->note_count > 0u)
        (void)snprintf(line, room, "off: %s", b->notes[(b->note_count - 1u) % BOARD_NOTES].text);
    else if (b->is_off)
        (void)snprintf(line, room, "off");
    else
        (void)snprintf(line, room, "on");
    return faulty == NULL && !b->is_off;
}

static void add_status(text *json, const server *self)
{
    char line[BOARD_NOTE_LENGTH + 16];
    const bool is_ok = server_status(self, line, sizeof line);
    text_add(json, ", \"ok\": %s, \"status\": ", is_ok ? "true" : "false");
    text_add_string(json, line);
}

unsigned server_losses(const server *self)
{
    unsigned losses = 0u;
    for (uint8_t peer = 0; peer < board_this.map->nodes; peer++)
        if (peer != board_this.map->node)
            losses += fsm_link_count(&self->link, peer, FSM_LINK_LOST_FRAMES);
    return losses;
}

static void add_links(text *json, const server *self)
{
    static const char *const names[FSM_LINK_COUNTS] = {
        [FSM_LINK_FRAMES] = "frames",       [FSM_LINK_LOST_FRAMES] = "lost_frames",
        [FSM_LINK_LOST_EVENTS] = "lost_events", [FSM_LINK_MISSED] = "missed",
        [FSM_LINK_LATE] = "late",           [FSM_LINK_DOUBLED] = "doubled",
        [FSM_LINK_OVERFLOW] = "overflow",   [FSM_LINK_RESTARTS] = "restarts",
    };
    bool is_first = true;
    text_add(json, ", \"links\": {");
    for (uint8_t peer = 0; peer < board_this.map->nodes; peer++) {
        if (peer == board_this.map->node)
            continue;
        text_add(json, "%s\"%s\": {", is_first ? "" : ", ", board_this.map->names[peer]);
        for (unsigned i = 0; i < FSM_LINK_COUNTS; i++)
            text_add(json, "%s\"%s\": %" PRIu32, i > 0u ? ", " : "", names[i],
                     fsm_link_count(&self->link, peer, (fsm_link_counter)i));
        text_add(json, "}");
        is_first = false;
    }
    text_add(json, "}, \"losses\": %u", server_losses(self));
    text_add(json, ", \"sent\": %" PRIu32 ", \"malformed\": %" PRIu32 ", \"foreign\": %" PRIu32,
             fsm_link_counted(&self->link, FSM_LINK_SENT),
             fsm_link_counted(&self->link, FSM_LINK_MALFORMED),
             fsm_link_counted(&self->link, FSM_LINK_FOREIGN));
}

static void add_machines(text *json)
{
    const size_t faults = sizeof fault_names / sizeof fault_names[0];
    text_add(json, ", \"states\": {");
    for (size_t i = 0; i < board_this.machine_count; i++) {
        const board_machine *const m = &board_this.machines[i];
        text_add(json, "%s\"%s\": ", i > 0 ? ", " : "", m->name);
        text_add_string(json, m->state_name(m->leaf()));
    }
    text_add(json, "}, \"faults\": {");
    for (size_t i = 0; i < board_this.machine_count; i++) {
        const board_machine *const m = &board_this.machines[i];
        const uint8_t fault = m->fault();
        text_add(json, "%s\"%s\": \"%s\"", i > 0 ? ", " : "", m->name,
                 fault < faults ? fault_names[fault] : "?");
    }
    text_add(json, "}");
}

static void add_notes(text *json, const board *b)
{
    const uint32_t held = b->note_count < BOARD_NOTES ? b->note_count : BOARD_NOTES;
    text_add(json, ", \"notes\": [");
    for (uint32_t i = 0; i < held; i++) {
        const board_note *const note = &b->notes[(b->note_count - held + i) % BOARD_NOTES];
        text_add(json, "%s{\"ms\": %" PRIu32 ", \"text\": ", i > 0u ? ", " : "", note->at);
        text_add_string(json, note->text);
        text_add(json, "}");
    }
    text_add(json, "]");
}

/* `last_overruns` and `jitter_ns` are as in fsm_posix_print_json: the jitter is a list of buckets, each
 * with its least lateness, that of the next bucket, and the number of wake-ups. */
static void add_loop(text *json, const fsm_posix *host)
{
    const char *before = "";
    const uint64_t kept = host->overruns < FSM_POSIX_LAST ? host->overruns : FSM_POSIX_LAST;
    text_add(json,
             ", \"cycles\": %" PRIu64 ", \"missed\": %" PRIu64 ", \"longest_step_ns\": %" PRIu64
             ", \"worst_jitter_ns\": %" PRIu64 ", \"reasons\": {",
             host->cycles, host->missed, host->longest_step_ns, host->worst_jitter_ns);
    for (unsigned k = 0; k < FSM_POSIX_REASONS; k++)
        text_add(json, "%s\"%s\": %" PRIu64, k > 0u ? ", " : "",
                 fsm_posix_reason_name((fsm_posix_reason)k), host->reasons[k]);
    text_add(json, "}, \"last_overruns\": [");
    for (uint64_t n = host->overruns - kept; n < host->overruns; n++) {
        const fsm_posix_overrun *const it = &host->last[n % FSM_POSIX_LAST];
        text_add(json,
                 "%s{\"cycle\": %" PRIu64 ", \"late_ns\": %" PRIu64 ", \"step_ns\": %" PRIu64
                 ", \"reason\": \"%s\", \"times\": %" PRIu64 "}",
                 before, it->cycle, it->late_ns, it->step_ns, fsm_posix_reason_name(it->reason),
                 it->times);
        before = ", ";
    }
    before = "";
    text_add(json, "], \"jitter_ns\": [");
    for (unsigned k = 0; k < FSM_POSIX_BUCKETS; k++) {
        if (host->jitter[k] == 0u)
            continue;
        text_add(json, "%s[%" PRIu64 ", %" PRIu64 ", %" PRIu64 "]", before, fsm_posix_bucket_ns(k),
                 fsm_posix_bucket_ns(k + 1u), host->jitter[k]);
        before = ", ";
    }
    text_add(json, "]");
}

static void report(server *self)
{
    text json = begin_text(self, 'R');
    text_add(&json, "{\"ms\": %" PRIu32 ", \"is_off\": %s", self->board.now,
             self->board.is_off ? "true" : "false");
    text_add(&json, ", \"overruns\": %" PRIu64 ", \"refused\": %u",
             self->host != NULL ? self->host->overruns : UINT64_C(0), refused(self));
    add_status(&json, self);
    add_links(&json, self);
    add_machines(&json);
    add_notes(&json, &self->board);
    if (self->host != NULL)
        add_loop(&json, self->host);
    text_add(&json, "}");
    end_text(self, &json);
}

/* ---- parameters -------------------------------------------------------------------------------------- */

static bool set_link(server *self, const char *name, double value)
{
    fsm_link_faults *const faults = &self->faults;
    if (strcmp(name, "dead") == 0 && value >= 0.0 && value <= 1.0)
        fsm_link_cut(faults, value > 0.5);
    else if (strcmp(name, "loss") == 0 && value >= 0.0 && value <= 1.0)
        faults->loss = (uint32_t)(value * 65536.0);
    else if (strcmp(name, "duplication") == 0 && value >= 0.0 && value <= 1.0)
        faults->duplication = (uint32_t)(value * 65536.0);
    else if (strcmp(name, "seed") == 0 && value >= 0.0 && value < 4294967296.0)
        faults->seed = (uint64_t)value;
    else
        return false;
    return true;
}

static bool set_parameter(server *self, const char *name, double value)
{
    if (strncmp(name, "link.", 5u) == 0)
        return set_link(self, name + 5, value);
    for (size_t i = 0; i < board_this.drive_count; i++) {
        const size_t length = strlen(board_this.drives[i].name);
        if (strncmp(name, board_this.drives[i].name, length) == 0 && name[length] == '.')
            return drive_set(board_this.drives[i].drive, name + length + 1u, value);
    }
    return false;
}

static void parameter(server *self, const char *asked)
{
    char name[64];
    double value;
    text json;
    if (!text_string_of(asked, "name", name, sizeof name) ||
        !text_number_of(asked, "value", &value)) {
        refuse(self, "a parameter needs a name and a value");
        return;
    }
    if (!set_parameter(self, name, value)) {
        refuse(self, "there is no such parameter, or the value is out of its range");
        return;
    }
    json = begin_text(self, 'P');
    text_add(&json, "{\"ok\": true}");
    end_text(self, &json);
}

/* ---- steps ------------------------------------------------------------------------------------------- */

/* How many frames of another board this one is to have had. It hears those sent since it began, and all
 * of a board that begins later, whose count falls back then. */
static uint32_t to_have_come(server *self, uint8_t peer, uint32_t sent)
{
    if (!self->board.has_started)
        self->unheard[peer] = sent;
    else if (sent < self->told[peer])
        self->unheard[peer] = 0u;
    self->told[peer] = sent;
    return sent - self->unheard[peer];
}

/* Let a step see exactly what the others had sent when it was asked for. */
static bool await(server *self, const uint8_t *frames)
{
    char why[160];
    for (uint8_t peer = 0; peer < board_this.map->nodes; peer++) {
        uint32_t expected;
        if (peer == board_this.map->node)
            continue;
        expected = to_have_come(self, peer, (uint32_t)fsm_link_get_bytes(frames, 4u));
        frames += 4;
        if (!self->is_linked || expected == 0u ||
            fsm_link_await(&self->link, peer, 0u, expected, AWAIT_MS) == FSM_LINK_READY)
            continue;
        fsm_link_explain(&self->link, why, sizeof why);
        board_off(&self->board, why);
        refuse(self, why);
        return false;
    }
    return true;
}

static void step(server *self, const uint8_t *body, size_t length)
{
    const size_t others = (size_t)board_this.map->nodes - 1u;
    const size_t head = 4u + 4u * others;
    uint32_t number;
    if (length != head + 4u * input_count()) {
        board_off(&self->board, "protocol: a step of the wrong length");
        refuse(self, "a step has another length");
        return;
    }
    number = (uint32_t)fsm_link_get_bytes(body, 4u);
    take_inputs(self, body + head);
    board_hears(&self->board);
    self->heard = self->board.now;
    if (self->host == NULL) {
        if (!await(self, body + 4))
            return;
        board_step(&self->board, number);
        server_write_map(self);
    }
    begin(self, 'S');
    put(self, number);
    put(self, fsm_link_counted(&self->link, FSM_LINK_SENT));
    put_outputs(self);
}

static void initial(server *self, const uint8_t *body, size_t length)
{
    if (length != 4u * input_count()) {
        refuse(self, "there is another number of inputs");
        return;
    }
    take_inputs(self, body);
    board_this.act(true);
    server_write_map(self);
    begin(self, 'I');
    put_outputs(self);
}

void server_answer(server *self, const uint8_t *request, size_t length)
{
    char json[LONGEST_JSON];
    const uint8_t *const body = request + 1;
    const size_t size = length - 1u;
    if (length == 0u || (size >= sizeof json && (request[0] == 'C' || request[0] == 'P'))) {
        refuse(self, "the request is empty, or too long");
        return;
    }
    if (size < sizeof json) {
        memcpy(json, body, size);
        json[size] = '\0';
    }
    switch (request[0]) {
    case 'C':
        connect(self, json);
        break;
    case 'I':
        initial(self, body, size);
        break;
    case 'K':
        check(self);
        break;
    case 'S':
        step(self, body, size);
        break;
    case 'P':
        parameter(self, json);
        break;
    case 'R':
        report(self);
        break;
    case 'Q':
        begin(self, 'Q');
        self->is_over = true;
        break;
    default:
        refuse(self, "there is no such request");
        break;
    }
}
