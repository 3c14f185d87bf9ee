/* pieces.h: names that the pieces of C use, so that a compiler reads them as they stand. */
#ifndef PIECES_H
#define PIECES_H
#include "fsm.h"

#define SELF_QUEUE 8u
#define SELF_INTERNAL 8u
#define SELF_TIMERS 4u
#define SELF_DELAYED 4u
#define SELF_MICROSTEPS 100u
#define SELF_REGIONS 3
#define SELF_REGION_COUNT 3u
#define SELF_PLACES 9u
#define SELF_PATH_LENGTH 9u
#define SELF_DEFER 0xFFFFu
#define SELF_INVOKER 1u
#define SELF_NO_EVENT {0u, 0u}
enum { SELF_EVENT_ERROR_EXECUTION = 1, SELF_EVENT_ERROR_RANGE };

typedef uint8_t self_event_number;
typedef uint16_t self_taken;
typedef uint8_t self_region;
typedef uint8_t self_number;
typedef uint16_t self_step;
typedef uint8_t self_within;
typedef uint8_t self_event_name;
typedef uint8_t self_state;
typedef struct {
    self_event_number event;
    uint8_t payload;
} self_event;
typedef struct {
    self_event e;
    uint16_t route;
    uint16_t peer;
} self_delayed;
typedef struct {
    uint32_t now;
    bool running, finished, busy;
    uint8_t fault, failed, active;
    uint16_t budget, rejected, unhandled;
    int reply;
    uint8_t queue_count, deferred_count, internal_count, delayed_count, timer_count;
    self_event event, queue[SELF_QUEUE], deferred[SELF_QUEUE], internal[SELF_INTERNAL];
    self_delayed delayed[SELF_DELAYED];
    fsm_timer timers[SELF_TIMERS];
    uint8_t to_invoke_[1];
} bookkeeping;
typedef struct {
    bookkeeping fsm;
} inside;
typedef struct {
    inside SLOT;
    bookkeeping fsm;
} self;

/* Conditions and statements of a chart. */
#define SELF_RUNNING m->fsm.running
#define SELF_STOPPED !m->fsm.running
#define SELF_REJECTS_POSTS SELF_STOPPED
#define SELF_REFUSES m->fsm.busy || !m->fsm.running
#define SELF_WAITING m->fsm.to_invoke_[0] != 0u
#define SELF_ACTIVE m->fsm.active
#define SELF_ASKED event
#define SELF_ASKED_EVENTLESS 9u
#define SELF_NOT_PARALLEL && place != 2u
#define SELF_ANSWER self_respond_any
#define SELF_STRICT (void)e
#define SELF_STRAIGHT (void)e
#define SELF_FORGET_ASKED (void)m
#define SELF_FORGET_HISTORIES (void)m
#define SELF_LEAVE_MACHINE self_leave(m, 0u)
#define SELF_STEP_SLOTS is_quiet = !inside_step_event(&m->SLOT)
#define SELF_STEP_TIMERS (void)inside_next_deadline(&m->SLOT, &due)
#if LOOPS
#define SELF_ACTED acted
#else
#define SELF_ACTED false
#endif
#if DEFERS
#define SELF_MAY_DEFER , bool may_defer
#define SELF_DEFERS , may_defer
#define SELF_ALWAYS , true
#define SELF_NEVER , false
#else
#define SELF_MAY_DEFER
#define SELF_DEFERS
#define SELF_ALWAYS
#define SELF_NEVER
#endif
#if EXTERNAL
#define SELF_IS_EXTERNAL , bool is_external
#define SELF_FROM_OUTSIDE , true
#define SELF_WITHIN , false
#else
#define SELF_IS_EXTERNAL
#define SELF_FROM_OUTSIDE
#define SELF_WITHIN
#endif

/* What printers and other pieces define. */
static const uint16_t self_last_below[9] = {0u}, self_source_of[9] = {0u};
static const uint8_t self_region_of[9] = {0u}, self_place_above[9] = {0u}, self_place_last[9] = {0u};
static const uint8_t self_path_places[9] = {0u}, self_path_of[9] = {0u};
static const uint8_t self_row_first[10] = {0u}, self_row_event[9] = {0u}, self_row_guard[9] = {0u};
static const uint8_t self_row_table[9][2] = {{0u}};
void inside_init(inside *m);
void inside_abandon(inside *m, uint32_t now);
bool inside_step_event(inside *m);
bool inside_next_deadline(const inside *m, uint32_t *deadline);
bool self_is_allowed(const self_event *e);
bool self_is_deferred(const self *m, uint16_t event);
bool self_next_deadline(const self *m, uint32_t *deadline);
bool self_step_timer(self *m);
bool self_return(self *m, const self_event *e);
uint16_t self_domain(const self *m, self_taken taken);
void self_record(self *m, uint16_t domain);
void self_leave(self *m, uint16_t domain);
void self_act(self *m, self_taken taken);
void self_enter(self *m, self_taken taken);
void self_entry_of(self *m, self_number place);
void self_exit_of(self *m, self_number place);
self_within *self_region_at(self *m, self_region region);
bool self_guard_of(self *m, self_taken taken);
uint8_t self_path_step(self *m, self_step code);
void self_external(self *m, const self_event *e);
void self_invoke(self *m);
void self_tell_end(self *m);

/* Pieces that stand after others which call them. */
static fsm_result self_unhandled(self *m, const self_event *e);
static bool self_may_go_on(self *m);
#if INVOKING
static bool self_settle(self *m);
#endif
#if SLOTS
static bool self_run_invoked(self *m);
#endif
#if SLOTS
static bool self_go_on(self *m);
#endif
static fsm_result self_respond(self *m, const self_event *e);

/* Printed for a chart; where the pieces have them, too, these are undefined before. */
uint16_t self_chosen(self *m, uint16_t event);
#define self_select_event(m, event) self_chosen(m, event)
#define self_select_eventless(m) self_chosen(m, 0u)
#define self_select_event_0(m, event, found) (void)((found)->count = (uint8_t)self_chosen(m, event))
#define self_select_eventless_0(m, found) (void)((found)->count = (uint8_t)self_chosen(m, 0u))
#define self_is_kept(m, event, found) (self_chosen(m, event) != 0u && (found)->count != 0u)
#endif
