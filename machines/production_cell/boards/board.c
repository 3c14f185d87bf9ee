#include "board.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum {
    HEARTBEAT_MS = 100,  /* silence of another board for longer: it is dead, or the link is */
    POWER_ALONE_MS = 1000 /* the supervisor has told of the power by then, if it was not told before */
};

void board_write_note(board *self, const char *format, ...)
{
    board_note *const note = &self->notes[self->note_count % BOARD_NOTES];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(note->text, sizeof note->text, format, arguments);
    va_end(arguments);
    note->at = self->now;
    self->note_count++;
}

void board_make(board *self, fsm_link *link, bool is_linked)
{
    memset(self, 0, sizeof *self);
    self->link = link;
    self->is_linked = is_linked;
    self->is_off = true; /* nothing was heard yet */
    board_this.make(link);
}

/* Whatever opens the chain, the board stays off until it is closed and reset was pressed then. */
static void watch_the_chain(board *self)
{
    const bool is_down = *board_this.reset;
    if (*board_this.estop) {
        if (!self->chain_was_open)
            board_write_note(self, "emergency chain open");
        self->chain_was_open = true;
    } else if (is_down && !self->reset_was_down) {
        self->chain_was_open = false;
    }
    self->reset_was_down = is_down;
}

static void turn_off_or_on(board *self)
{
    const bool is_powered = *board_this.power;
    const bool is_off = !is_powered || self->chain_was_open || self->is_deaf;
    if (is_off && !self->is_off) {
        if (!is_powered)
            board_write_note(self, "no power");
        board_this.stop_all();
    }
    self->is_off = is_off;
    self->powered_ms = is_powered ? self->powered_ms + 1u : 0u;
    if (self->powered_ms == POWER_ALONE_MS)
        board_this.power_up();
}

/* What was lost may have been a handshake: all modules fail, and say so to the supervisor. */
static bool has_failed(board *self, uint8_t peer)
{
    const char *const name = board_this.map->names[peer];
    const uint32_t lost = fsm_link_count(self->link, peer, FSM_LINK_LOST_EVENTS);
    const uint32_t restarts = fsm_link_count(self->link, peer, FSM_LINK_RESTARTS);
    const bool was_heard = fsm_link_session(self->link, peer) != 0u;
    const bool is_silent = was_heard && fsm_link_silence(self->link, peer) > HEARTBEAT_MS;
    bool failed = false;
    if (restarts != self->restarts[peer]) {
        board_write_note(self, "link: board %s was restarted", name);
        failed = true;
    } else if (lost != self->lost_events[peer]) {
        board_write_note(self, "link: %u events of board %s lost",
                         (unsigned)(lost - self->lost_events[peer]), name);
        failed = true;
    }
    if (is_silent && !self->is_silent[peer]) {
        board_write_note(self, "link: board %s silent for %d ms", name, HEARTBEAT_MS);
        failed = true;
    }
    self->restarts[peer] = restarts;
    self->lost_events[peer] = lost;
    self->is_silent[peer] = is_silent;
    return failed;
}

static void watch_the_links(board *self)
{
    bool failed = false;
    if (!self->is_linked)
        return;
    for (uint8_t peer = 0; peer < board_this.map->nodes; peer++)
        if (peer != board_this.map->node && has_failed(self, peer))
            failed = true;
    if (failed)
        board_this.fail_all();
}

void board_step(board *self, uint32_t now)
{
    self->now = now;
    if (!self->has_started)
        board_this.start(now - 1u);
    self->has_started = true;
    board_this.sense();
    watch_the_chain(self);
    turn_off_or_on(self);
    watch_the_links(self);
    board_this.cycle(now, self->is_off);
    board_this.act(self->is_off);
}

void board_off(board *self, const char *why)
{
    if (!self->is_deaf) {
        board_write_note(self, "%s", why);
        self->is_deaf = true;
        self->is_off = true;
        board_this.stop_all();
    }
    board_this.act(true);
}

void board_hears(board *self)
{
    self->is_deaf = false;
}
