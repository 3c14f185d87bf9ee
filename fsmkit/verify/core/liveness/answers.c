#include "liveness/answers.h"

#include "symbolic/evaluation.h"
#include "symbolic/relation.h"
#include "paths/approach.h"
#include "paths/lasso.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static bool is_leads_to(const fsm_answer *answer)
{
    return strcmp(answer->option, "--leads-to") == 0;
}

static bool is_recoverable(const fsm_answer *answer)
{
    return strcmp(answer->option, "--recoverable") == 0;
}

bool fsm_answers_init(fsm_answers *self, const char *const *options, uint32_t count, bool timeless)
{
    *self = (fsm_answers){.items = calloc(count + 1u, sizeof *self->items), .count = count, .timeless = timeless};
    for (uint32_t i = 0; self->items != NULL && i < count; i++) {
        self->items[i].option = options[(size_t)2 * i];
        self->items[i].argument = options[(size_t)2 * i + 1];
    }
    return self->items != NULL;
}

void fsm_answers_free(fsm_answers *self)
{
    for (uint32_t i = 0; self->items != NULL && i < self->count; i++) {
        free(self->items[i].path.steps);
        free(self->items[i].cycle.steps);
    }
    free(self->items);
    *self = (fsm_answers){0};
}

bool fsm_answers_need_actions(const fsm_answers *self)
{
    bool found = false;
    for (uint32_t i = 0; i < self->count; i++)
        found = found || is_leads_to(&self->items[i]);
    return found;
}

bool fsm_answers_are_known(const fsm_answers *self)
{
    bool known = true;
    for (uint32_t i = 0; i < self->count; i++)
        known = known && self->items[i].known;
    return known;
}

/* --- deciding ------------------------------------------------------------------------------------------- */

/* AG EF of the condition of a mark: the states that cannot reach it are those not in its closure backwards. */
static void decide_recovery(fsm_answer *answer, fsm_symbolic *symbolic, uint32_t property)
{
    fsm_mdd *mdd = &symbolic->mdd;
    fsm_relation back;
    fsm_evaluated goal = fsm_evaluate(symbolic, symbolic->root, property, true);
    answer->sets.unevaluated = !goal.known && !mdd->failed;
    if (!goal.known || !fsm_mdd_root(mdd, goal.marked) || !fsm_relation_make(&back, symbolic, true, NULL, NULL))
        return;
    uint32_t helped = fsm_relation_close(&back, goal.marked, symbolic->root);
    uint32_t lost = mdd->failed ? 0 : fsm_mdd_difference(mdd, symbolic->root, helped);
    fsm_relation_free(&back);
    answer->lost = --mdd->root_count;
    answer->known = !mdd->failed && fsm_mdd_root(mdd, lost);
    answer->violated = answer->known && lost != 0;
}

static void decide(fsm_answer *answer, fsm_symbolic *symbolic, bool timeless)
{
    char *end;
    uint32_t first = (uint32_t)strtoul(answer->argument, &end, 10);
    uint32_t second = *end == ',' ? (uint32_t)strtoul(end + 1, &end, 10) : 0;
    size_t roots = symbolic->mdd.root_count;
    if (is_recoverable(answer)) {
        decide_recovery(answer, symbolic, first - 1);
    } else if (is_leads_to(answer)) {
        answer->sets = fsm_find_fair_sets(symbolic, first - 1, second - 1, timeless);
        answer->known = answer->sets.known;
        answer->violated = answer->sets.violated;
    }
    if (!answer->known)
        symbolic->mdd.root_count = roots;
}

void fsm_answers_decide(fsm_answers *self, fsm_symbolic *symbolic)
{
    for (uint32_t i = 0; i < self->count; i++) {
        fsm_answer *answer = &self->items[i];
        answer->known = answer->violated = false;
        if (symbolic->outcome == FSM_COMPLETE)
            decide(answer, symbolic, self->timeless);
        answer->why = answer->known                       ? NULL
            : symbolic->outcome != FSM_COMPLETE           ? fsm_outcome_name(symbolic->outcome)
            : answer->sets.unevaluated                       ? "combinations"
                                                          : fsm_outcome_name(FSM_OUT_OF_MEMORY);
        symbolic->mdd.failed = false; /* nodes created before are valid */
    }
}

/* --- ways ------------------------------------------------------------------------------------------------- */

/* Return the nearest state of a set if it can be computed, else any state of it. */
static bool find_path(fsm_answer *answer, const fsm_path_context *ways, uint32_t set)
{
    fsm_symbolic *symbolic = ways->symbolic;
    fsm_path_context more = *ways;
    answer->path.count = 0;
    if (fsm_path_to_set(ways, set, &answer->path))
        return true;
    symbolic->max_created = symbolic->mdd.made + fsm_max_nodes_of_paths();
    bool found = fsm_path_by_distances(ways, set, &answer->path);
    symbolic->max_created = 0;
    symbolic->mdd.failed = false;
    more.states = fsm_max_states_of_paths();
    found = found || (more.states > ways->states && fsm_path_to_set(&more, set, &answer->path));
    if (found)
        return true;
    answer->longer = fsm_path_by_approach(ways, set, &answer->path);
    symbolic->mdd.failed = false;
    return answer->longer;
}

void fsm_answers_find_paths(fsm_answers *self, const fsm_path_context *ways)
{
    fsm_symbolic *symbolic = ways->symbolic;
    for (uint32_t i = 0; i < self->count && symbolic->outcome == FSM_COMPLETE; i++) {
        fsm_answer *answer = &self->items[i];
        if (!answer->violated)
            continue;
        bool has_sets = is_leads_to(answer);
        uint32_t set = has_sets ? fsm_set_of(symbolic, &answer->sets, FSM_SET_HOPELESS) : symbolic->mdd.roots[answer->lost];
        bool found = find_path(answer, ways, set);
        answer->longer = answer->longer || (has_sets && !answer->sets.has_all);
        if (!found || (has_sets && !fsm_cycle_in_sets(ways, &answer->sets, &answer->path, &answer->cycle)))
            answer->path.count = answer->cycle.count = 0;
        symbolic->mdd.failed = false;
    }
}

/* --- the result --------------------------------------------------------------------------------------------- */

static void print_steps(const char *name, const fsm_path *path)
{
    printf("\"%s\": [", name);
    for (size_t i = 0; i < path->count; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ", ", path->steps[i]);
    printf("]");
}

void fsm_answers_print(const fsm_answers *self)
{
    printf(", \"temporal\": [");
    for (uint32_t i = 0; i < self->count; i++) {
        const fsm_answer *answer = &self->items[i];
        printf("%s{\"known\": %s, \"violated\": %s, ", i == 0 ? "" : ", ", answer->known ? "true" : "false",
               answer->violated ? "true" : "false");
        if (answer->why != NULL)
            printf("\"unknown\": \"%s\", ", answer->why);
        print_steps("path", &answer->path);
        printf(", ");
        print_steps("cycle", &answer->cycle);
        printf("%s}", answer->longer ? ", \"longer\": true" : "");
    }
    printf("]");
}
