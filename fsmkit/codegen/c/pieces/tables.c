/* The functions that read the tables of a small machine.
 *
 * An active state is one of SELF_PLACES, and a path ends with 0. The bounds below state this for static
 * analysis, which does not evaluate the tables. */

#if PLAIN
/* Appendix D, selectTransitions, for one atomic state: the row plus one. */
static self_taken self_select_at(self *m, self_number place, uint16_t event)
{
    for (; place != 0u; place = self_place_above[place]) {
        for (uint32_t row = self_row_first[place]; row < self_row_first[place + 1u]; row++) {
            if (self_row_event[row] == event && self_guard_of(m, self_row_guard[row])) {
                return (self_taken)(row + 1u);
            }
        }
    }
    return 0u;
}

#else
/* Appendix D, selectTransitions, for one atomic state. */
static self_taken self_select_at(self *m, self_number place, uint16_t event)
{
    for (; place - 1u < SELF_PLACES; place = self_place_above[place]) {
        for (uint32_t row = self_row_first[place]; row < self_row_first[place + 1u]; row++) {
            if (self_row_table[row][0] == event && self_guard_of(m, self_row_table[row][1])) {
                return self_row_table[row][1];
            }
        }
    }
    return 0u;
}
#endif

#if SINGLE
static void self_enter_place(self *m, self_number place)
{
    SELF_ACTIVE = place;
    self_entry_of(m, place);
}

/* Exit the active states up to a state, innermost first. */
static void self_leave_until(self *m, self_number until, bool keep)
{
    self_number place = SELF_ACTIVE;
    while (place > until && place - 1u < SELF_PLACES) {
        self_exit_of(m, place);
        place = self_place_above[place];
        if (!keep) {
            SELF_ACTIVE = place;
        }
    }
}

static self_taken self_select_event(self *m, uint16_t event)
{
    return self_select_at(m, SELF_ACTIVE, SELF_ASKED);
}

static self_taken self_select_eventless(self *m)
{
    return self_select_at(m, SELF_ACTIVE, SELF_ASKED_EVENTLESS);
}

#else
static void self_enter_place(self *m, self_number place)
{
    *self_region_at(m, self_region_of[place]) = (self_within)place;
    self_entry_of(m, place);
}

/* Exit the active states up to a state, innermost first; `last` is the last region below it. */
static void self_leave_until(self *m, self_number until, self_region last, bool keep)
{
    for (self_region region = last;; region--) {
        const bool is_own = region == self_region_of[until];
        self_within *active = self_region_at(m, region);
        self_number place = *active;
        while (place > (is_own ? until : 0u)) {
            self_exit_of(m, place);
            place = self_place_above[place];
            if (self_region_of[place] != region) {
                place = 0u;
            }
            if (!keep) {
                *active = (self_within)place;
            }
        }
        if (is_own) {
            return;
        }
    }
}

static void self_select_event_0(self *m, uint16_t event, self_selection *found)
{
    for (self_region region = 0u; region < SELF_REGION_COUNT; region++) {
        const self_number place = *self_region_at(m, region);
        if (place != 0u SELF_NOT_PARALLEL) {
            self_add(found, self_select_at(m, place, SELF_ASKED));
        }
    }
}

static void self_select_eventless_0(self *m, self_selection *found)
{
    for (self_region region = 0u; region < SELF_REGION_COUNT; region++) {
        const self_number place = *self_region_at(m, region);
        if (place != 0u SELF_NOT_PARALLEL) {
            self_add(found, self_select_at(m, place, SELF_ASKED_EVENTLESS));
        }
    }
}
#endif

/* Enter a state and those of its ancestors that are not active yet. */
static void self_enter_recorded(self *m, uint16_t after, uint16_t last)
{
    for (uint16_t place = after; place < last; place++) {
        if (self_place_last[place + 1u] >= last) {
            self_enter_place(m, (self_number)(place + 1u));
        }
    }
}

#if SPECIAL_STEPS
static void self_enter_path(self *m, uint32_t at)
{
#if PLAIN
    for (at++; at < SELF_PATH_LENGTH && self_path_places[at] != 0u; at++) {
#else
    for (; at < SELF_PATH_LENGTH && self_path_places[at] != 0u; at++) {
#endif
        const uint32_t step = self_path_places[at];
        if (step <= SELF_PLACES) {
            self_enter_place(m, (self_number)step);
        } else {
            at += self_path_step(m, (self_step)step);
        }
    }
    SELF_FORGET_HISTORIES;
}

#else
static void self_enter_path(self *m, uint32_t at)
{
#if PLAIN
    while (self_path_places[++at] != 0u) {
#else
    for (; self_path_places[at] != 0u; at++) {
#endif
        self_enter_place(m, self_path_places[at]);
    }
    SELF_FORGET_HISTORIES;
}
#endif

#if PLAIN
static void self_take(self *m, self_taken taken)
{
#if FAULTY
    if (taken == 0u || m->fsm.fault != FSM_NO_FAULT) {
#else
    if (taken == 0u) {
#endif
        return;
    }
    const uint32_t at = self_path_of[taken - 1u];
    if (at != 0u) {
        self_leave_until(m, self_path_places[at], false);
    }
    self_act(m, taken);
    self_enter_path(m, at);
}
#endif
