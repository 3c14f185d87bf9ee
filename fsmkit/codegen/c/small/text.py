"""What reads the tables of a small machine: C with the prefix filled in (see `helpers.fill`)."""

ENTER_ONE = """
static void @_enter_place(@ *m, $NUMBER place)
{
    $ACTIVE = place;
    @_entry_of(m, place);
}
"""

ENTER_MANY = """
static void @_enter_place(@ *m, $NUMBER place)
{
    *@_region_at(m, @_region_of[place]) = ($WITHIN)place;
    @_entry_of(m, place);
}
"""

LEAVE_ONE = """
/* Leave what is active, innermost first, until a state. */
static void @_leave_until(@ *m, $NUMBER until, bool keep)
{
    $NUMBER place = $ACTIVE;
    while (place > until) {
        @_exit_of(m, place);
        place = @_place_above[place];
        if (!keep) {
            $ACTIVE = place;
        }
    }
}
"""

LEAVE_MANY = """
/* Leave what is active, innermost first, until a state; `last` is the last region below it. */
static void @_leave_until(@ *m, $NUMBER until, $REGION last, bool keep)
{
    for ($REGION region = last;; region--) {
        const bool is_own = region == @_region_of[until];
        $WITHIN *active = @_region_at(m, region);
        $NUMBER place = *active;
        while (place > (is_own ? until : 0u)) {
            @_exit_of(m, place);
            place = @_place_above[place];
            if (@_region_of[place] != region) {
                place = 0u;
            }
            if (!keep) {
                *active = ($WITHIN)place;
            }
        }
        if (is_own) {
            return;
        }
    }
}
"""

RESTORE = """
/* Enter the states around a place and that itself, after those that are active. */
static void @_enter_recorded(@ *m, uint16_t after, uint16_t last)
{
    for (uint16_t place = after; place < last; place++) {
        if (@_place_last[place + 1u] >= last) {
            @_enter_place(m, ($NUMBER)(place + 1u));
        }
    }
}
"""

WALK_PLAIN = """
static void @_enter_path(@ *m, uint32_t at)
{
    $WALK
        @_enter_place(m, @_path_places[at]);
    }
$FORGET}
"""

WALK = """
static void @_enter_path(@ *m, uint32_t at)
{
    $WALK
        if (@_path_places[at] <= $PLACESu) {
            @_enter_place(m, ($NUMBER)@_path_places[at]);
        } else {
            at += @_path_step(m, @_path_places[at]);
        }
    }
$FORGET}
"""

FIND = """
/* Appendix D, selectTransitions, for one atomic state. */
static $TAKEN @_select_at(@ *m, $NUMBER place, uint16_t event)
{
    for (; place != 0u; place = @_place_above[place]) {
        for (uint32_t row = @_row_first[place]; row < @_row_first[place + 1u]; row++) {
            if (@_row_table[row][0] == event && @_guard_of(m, @_row_table[row][1])) {
                return @_row_table[row][1];
            }
        }
    }
    return 0u;
}
"""

FIND_PLAIN = """
/* Appendix D, selectTransitions, for one atomic state: the row plus one. */
static $TAKEN @_select_at(@ *m, $NUMBER place, uint16_t event)
{
    for (; place != 0u; place = @_place_above[place]) {
        for (uint32_t row = @_row_first[place]; row < @_row_first[place + 1u]; row++) {
            if (@_row_event[row] == event && @_guard_of(m, @_row_guard[row])) {
                return ($TAKEN)(row + 1u);
            }
        }
    }
    return 0u;
}
"""

TAKE_PLAIN = """
static void @_take(@ *m, $TAKEN taken)
{
    if (taken == 0u$FAULTY) {
        return;
    }
    const uint32_t at = @_path_of[taken - 1u];
    if (at != 0u) {
        @_leave_until(m, @_path_places[at], false);
    }
    @_act(m, taken);
    @_enter_path(m, at);
}
"""

SELECT_ONE = """
static $TAKEN @_$NAME(@ *m$PARAMETER)
{
    return @_select_at(m, $ACTIVE, $EVENT);
}
"""

SELECT_MANY = """
static void @_$NAME_0(@ *m$PARAMETER, @_selection *found)
{
    for ($REGION region = 0u; region < $REGIONSu; region++) {
        const $NUMBER place = *@_region_at(m, region);
        if (place != 0u$ATOMIC) {
            @_add(found, @_select_at(m, place, $EVENT));
        }
    }
}
"""
