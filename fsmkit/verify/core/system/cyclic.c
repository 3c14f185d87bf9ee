#include "system/cyclic.h"

/* The node of a machine. */
static fsm_node *leaf(const fsm_tree *tree, uint32_t machine)
{
    fsm_node *node = tree->root_right != NULL && machine >= tree->root_right->first ? tree->root_right : tree->root_left;
    while (node->left != NULL)
        node = machine < node->left->last ? node->left : node->right;
    return node;
}

static const fsm_summary *summary(const fsm_tree *tree, const fsm_turn *turn, uint32_t machine)
{
    return &fsm_node_at(leaf(tree, machine), turn->locals[machine])->summary;
}

static const fsm_moves *moves_of(fsm_composition *self, uint32_t thread, const fsm_turn *turn, uint32_t machine,
                                 fsm_part part)
{
    return fsm_node_moves(self->tree, thread, leaf(self->tree, machine), turn->locals[machine], part);
}

/* --- what can be taken ------------------------------------------------------------------------------ */

static void add_source(fsm_turn *turn, uint32_t machine, fsm_part part)
{
    turn->sources[turn->count++] = (fsm_source){machine, part};
}

/* Adds the steps of a machine that may move; false if memory ran out. Sets `*busy` if work remains. */
static bool add_machine(fsm_composition *self, uint32_t thread, fsm_turn *turn, uint32_t machine, bool open, bool *busy)
{
    const fsm_moves *own = moves_of(self, thread, turn, machine, FSM_OWN);
    if (own == NULL)
        return false;
    *busy = *busy || own->busy;
    add_source(turn, machine, FSM_OWN);
    if (open)
        add_source(turn, machine, FSM_OPEN);
    return true;
}

void fsm_turn_holds(const fsm_composition *self, const uint32_t *locals, fsm_hold *holds)
{
    const fsm_system *system = self->system;
    for (uint32_t i = 0; i < system->machine_count; i++) {
        uint32_t freezer = system->freezers == NULL ? FSM_NONE : system->freezers[i];
        holds[i] = freezer == FSM_NONE ? FSM_HOLD_NONE : system->hold(freezer, fsm_local(self, freezer, locals[freezer]));
    }
}

/* Whose turn it is, from 1; 0: nobody's. While it has something left to do and is not frozen, its turn is not over. */
static bool find_turn(fsm_composition *self, uint32_t thread, const fsm_turn *turn, uint32_t *number, bool *over)
{
    uint32_t scheduler = self->system->machine_count - 1;
    *over = true;
    *number = 0;
    if (self->system->turn != NULL)
        *number = self->system->turn(fsm_local(self, scheduler, turn->locals[scheduler]));
    if (*number == 0 || turn->holds[*number - 1] != FSM_HOLD_NONE)
        return true;
    const fsm_moves *own = moves_of(self, thread, turn, *number - 1, FSM_OWN);
    *over = own != NULL && !own->busy;
    return own != NULL;
}

bool fsm_turn_find(fsm_composition *self, uint32_t thread, fsm_state state, fsm_turn *found)
{
    const fsm_system *system = self->system;
    uint32_t count = system->machine_count, waiting = 0, number;
    fsm_part first = FSM_OWN;
    bool busy = false, ticking = false, over;
    found->count = 0;
    fsm_tree_unfold(self->tree, state, found->locals);
    fsm_turn_holds(self, found->locals, found->holds);
    for (uint32_t i = 0; i < count; i++) {
        const fsm_summary *seen = summary(self->tree, found, i);
        ticking = ticking || (seen->ticking && found->holds[i] != FSM_HOLD_STOPPED);
        if (found->holds[i] != FSM_HOLD_NONE)
            continue;
        waiting += seen->waiting;
        first = seen->first < first ? seen->first : first;
    }
    found->may_pass = false;
    for (uint32_t i = 0; i < count && first != FSM_OWN; i++)
        if (found->holds[i] == FSM_HOLD_NONE && summary(self->tree, found, i)->first == first)
            add_source(found, i, first);
    if (first != FSM_OWN)
        return true;
    if (!find_turn(self, thread, found, &number, &over))
        return false;
    for (uint32_t i = 0; i < count; i++) {
        bool in_turn = system->turn == NULL || (i + 1 == count ? over : i + 1 == number || !system->ordered[i]);
        if (in_turn && found->holds[i] == FSM_HOLD_NONE
            && !add_machine(self, thread, found, i, waiting <= system->max_pending_before_input, &busy))
            return false;
    }
    found->may_pass = !busy && ticking;
    return true;
}

/* --- steps ---------------------------------------------------------------------------------------- */

static bool append(fsm_composition *self, const uint32_t *locals, uint32_t marks, unsigned char kind, fsm_steps *steps)
{
    fsm_lock_take(self->lock);
    fsm_state to = fsm_tree_fold(self->tree, locals);
    fsm_lock_leave(self->lock);
    return (to != FSM_NO_STATE && fsm_steps_add(steps, to, marks, (fsm_kind)kind)) || fsm_fail(self, "out of memory");
}

/* Adds a step of a machine, with what it sends to the others. */
static bool add_step(fsm_composition *self, const fsm_turn *turn, uint32_t machine, fsm_move move, fsm_steps *steps)
{
    fsm_tree *tree = self->tree;
    uint32_t locals[FSM_MOST_MACHINES];
    for (uint32_t i = 0; i < self->system->machine_count; i++) {
        uint32_t sent = turn->holds[i] == FSM_HOLD_STOPPED ? 0 : move.sent;
        uint64_t reached = i == machine ? fsm_join(move.to, 0) : fsm_node_deliver(tree, leaf(tree, i), turn->locals[i], sent);
        if (reached == UINT64_MAX)
            return false;
        locals[i] = fsm_left(reached);
        move.marks = fsm_tree_join_marks(tree, move.marks, fsm_right(reached));
        if (move.marks == FSM_NONE)
            return fsm_fail(self, "out of memory");
    }
    return append(self, locals, move.marks, move.kind, steps);
}

static bool pass_time(fsm_composition *self, const fsm_turn *turn, fsm_steps *steps)
{
    uint32_t locals[FSM_MOST_MACHINES];
    for (uint32_t i = 0; i < self->system->machine_count; i++) {
        bool is_stopped = turn->holds[i] == FSM_HOLD_STOPPED;
        locals[i] = is_stopped ? turn->locals[i] : fsm_node_elapse(self->tree, leaf(self->tree, i), turn->locals[i]);
        if (locals[i] == FSM_NONE)
            return false;
    }
    return append(self, locals, 0, FSM_STEP_TIME, steps);
}

/* Nothing waits, no timer is awaited, and not even in its turn has any machine anything to do. Those of a node that is
 * stopped do not count. */
static bool find_deadlock(fsm_composition *self, const fsm_turn *turn, fsm_steps *steps)
{
    bool faulted = false, all_rest = true, active = false;
    uint32_t count = self->system->machine_count;
    steps->deadlock = false;
    for (uint32_t i = 0; i < count; i++) {
        const fsm_summary *seen = summary(self->tree, turn, i);
        if (turn->holds[i] == FSM_HOLD_STOPPED)
            continue;
        if (seen->waiting > 0 || seen->awaited > 0)
            return true;
        faulted = faulted || seen->faulted;
        all_rest = all_rest && seen->at_rest;
    }
    for (uint32_t i = 0; i < count; i++) {
        if (turn->holds[i] == FSM_HOLD_STOPPED)
            continue;
        const fsm_moves *own = moves_of(self, steps->thread, turn, i, FSM_OWN);
        bool busy = own != NULL && own->busy, fair = own != NULL && own->fair;
        const fsm_moves *open = own == NULL ? NULL : moves_of(self, steps->thread, turn, i, FSM_OPEN);
        if (open == NULL)
            return false;
        active = active || busy || fair || open->fair;
    }
    steps->deadlock = !self->system->open && !faulted && !all_rest && !active;
    return true;
}

bool fsm_turn_steps(fsm_composition *self, const fsm_turn *turn, fsm_steps *steps)
{
    for (uint32_t i = 0; i < turn->count; i++) {
        fsm_source source = turn->sources[i];
        const fsm_moves *moves = moves_of(self, steps->thread, turn, source.machine, source.part);
        for (uint32_t n = 0; moves != NULL && n < moves->count; n++)
            if (!add_step(self, turn, source.machine, moves->items[n], steps))
                return false;
        if (moves == NULL)
            return false;
    }
    if (turn->may_pass && self->system->unit > 0 && !pass_time(self, turn, steps))
        return false;
    return find_deadlock(self, turn, steps);
}

bool fsm_turn_describe(fsm_composition *self, const fsm_turn *turn, uint32_t ordinal, fsm_description *what)
{
    for (uint32_t i = 0; i < turn->count; i++) {
        fsm_source source = turn->sources[i];
        const fsm_moves *moves = moves_of(self, 0, turn, source.machine, source.part);
        if (moves == NULL)
            return false;
        if (ordinal < moves->count) {
            fsm_node *node = leaf(self->tree, source.machine);
            *what = fsm_node_describe(self->tree, node, turn->locals[source.machine], source.part, ordinal);
            return true;
        }
        ordinal -= moves->count;
    }
    *what = (fsm_description){.action = FSM_DO_ELAPSE};
    return true;
}
