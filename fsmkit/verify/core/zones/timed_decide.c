#include "report.h"
#include "zones/timed_main.h"
#include "zones/timed_temporal.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const char *option;
    uint32_t first, second; /* marks; the one to be reached is the last one */
} property;

static property read_property(const char *option, const char *argument)
{
    char *end;
    uint32_t first = (uint32_t)strtoul(argument, &end, 10);
    return (property){option, first, *end == ',' ? (uint32_t)strtoul(end + 1, NULL, 10) : first};
}

static fsm_timed_answer decide(fsm_timed_model *model, fsm_search *search, bool timeless, property selected)
{
    if (search->outcome != FSM_COMPLETE)
        return (fsm_timed_answer){.why = ""};
    return strcmp(selected.option, "--recoverable") == 0
        ? fsm_timed_recoverable(model, search, selected.first)
        : fsm_timed_leads_to(model, search, selected.first, selected.second, timeless);
}

static void print_path(const char *name, const fsm_path *path)
{
    printf(", \"%s\": [", name);
    for (size_t i = 0; i < path->count; i++)
        printf("%s%" PRId32, i == 0 ? "" : ", ", (int32_t)path->steps[i]);
    printf("]");
}

/* The methods to try in order while properties are undecided. */
typedef struct {
    fsm_timed_cover cover;
    uint64_t most; /* states after which the exploration ends; 0: none */
} attempt;

/* Many violations are near the start; a cycle of the simulated graph may be one of no point, where one of points is near. The hull
 * has far fewer states than the graphs after it. */
static const attempt attempts[] = {{FSM_COVER_SIMULATED, 10000}, {FSM_COVER_POINTS, 30000},   {FSM_COVER_HULL, 0},
                                   {FSM_COVER_SIMULATED, 0},     {FSM_COVER_POINTS, 1000000}, {FSM_COVER_SUBSET, 0},
                                   {FSM_COVER_EQUAL, 0}};
enum { ATTEMPTS = sizeof attempts / sizeof *attempts };

static attempt read_attempt(const char *text)
{
    static const char *const names[] = {"equal", "subset", "simulated", "hull", "points"};
    size_t length = strcspn(text, ",");
    attempt found = {FSM_COVER_EQUAL, text[length] == ',' ? (uint64_t)strtoull(text + length + 1, NULL, 10) : 0};
    for (int i = FSM_COVER_EQUAL; i <= FSM_COVER_POINTS; i++)
        if (strlen(names[i]) == length && strncmp(names[i], text, length) == 0)
            found.cover = (fsm_timed_cover)i;
    return found;
}

typedef struct {
    fsm_timed_answer *answers;
    uint32_t states;
    uint64_t zones;
    size_t bytes;
    double most_discrete; /* an upper bound of the states in discrete time; 0: it is not known */
    fsm_outcome outcome;
    unsigned whole;       /* a bit for each cover of which all states were explored */
    const char *why;
} decisions;

/* The states in discrete time are among these: each timer has any remaining time. */
static double most_discrete(fsm_timed *timed)
{
    double all = 0;
    for (uint32_t tuple = 0; tuple < timed->tuples.count; tuple++) {
        const uint32_t *locals = fsm_store_at(&timed->tuples, tuple);
        uint32_t size = fsm_timed_size(timed, locals);
        double here = 1;
        bool choice;
        if (!fsm_timed_limits(timed, locals, timed->limits, &choice))
            return 0;
        for (uint32_t i = 1; i < size; i++) {
            fsm_limits l = timed->limits[i];
            here *= 1.0 + (l.upper != FSM_NEVER ? l.upper : l.lower > 0 ? l.lower : 0);
        }
        all += here;
    }
    return all;
}

static property asked_by(const fsm_timed_options *options, uint32_t number)
{
    return read_property(options->temporal[2 * number], options->temporal[2 * number + 1]);
}

/* Makes a graph of the states that were explored. */
static bool hope(fsm_timed_model *model, const fsm_search *search, const fsm_timed_options *options)
{
    uint32_t *goals = malloc(options->temporal_count * sizeof *goals);
    for (uint32_t i = 0; goals != NULL && i < options->temporal_count; i++)
        goals[i] = asked_by(options, i).second;
    bool fine = goals != NULL && fsm_timed_be_partial(model, &search->passed, goals, options->temporal_count);
    free(goals);
    return fine;
}

static bool keep_on(fsm_search *search)
{
    if (search->most > 0 && search->passed.count > search->most)
        search->outcome = FSM_DECIDED;
    return search->outcome == FSM_COMPLETE && fsm_keep_pace(search);
}

/* Decides what is not decided yet; false if nothing more is to be tried. */
static bool decide_with(decisions *self, fsm_composition *composition, const fsm_timed_options *options, attempt tried)
{
    fsm_timed_model model;
    fsm_search search;
    if (!fsm_timed_model_init(&model, composition, options->memory)) {
        self->outcome = FSM_OUT_OF_MEMORY;
        return false;
    }
    model.cover = tried.cover;
    if (!fsm_search_init(&search, &model.model, options->memory)) {
        fsm_timed_model_free(&model);
        self->outcome = FSM_OUT_OF_MEMORY;
        return false;
    }
    search.keep_on = keep_on;
    search.most = tried.most;
    search.seeks_on = fsm_seek_on;
    search.trace = fsm_timed_trace;
    search.context = options->pace;
    options->pace->counted = &model.timed.tuples.count;
    fsm_search_run(&search);
    if (search.outcome == FSM_MODEL_FAILED && model.failure != NULL)
        search.outcome = FSM_OUT_OF_MEMORY; /* the model has no other failure */
    bool open = false;
    bool whole = search.outcome == FSM_COMPLETE;
    self->whole |= (unsigned)whole << tried.cover;
    if (search.outcome == FSM_DECIDED) {
        search.most = 0;
        search.outcome = hope(&model, &search, options) ? FSM_COMPLETE : FSM_OUT_OF_MEMORY;
    }
    for (uint32_t i = 0; i < options->temporal_count; i++) {
        fsm_timed_answer *answer = &self->answers[i];
        if (!answer->known)
            *answer = decide(&model, &search, options->timeless, asked_by(options, i));
        open = open || !answer->known;
    }
    const char *why = model.model.failure(&model);
    if (whole && self->most_discrete <= 0)
        self->most_discrete = most_discrete(&model.timed);
    self->outcome = search.outcome;
    self->why = why == NULL ? "" : why;
    self->states = model.timed.tuples.count > self->states ? model.timed.tuples.count : self->states;
    self->zones = search.passed.count;
    self->bytes = fsm_search_bytes(&search);
    options->pace->counted = NULL;
    fsm_search_free(&search);
    fsm_timed_model_free(&model);
    return open && self->outcome == FSM_COMPLETE;
}

int fsm_timed_decide(fsm_composition *composition, const fsm_timed_options *options)
{
    decisions all = {.answers = calloc(options->temporal_count, sizeof *all.answers), .why = ""};
    if (all.answers == NULL)
        return FSM_NO_MEMORY;
    for (uint32_t i = 0; i < options->temporal_count; i++)
        all.answers[i].why = "";
    if (options->cover != NULL)
        (void)decide_with(&all, composition, options, read_attempt(options->cover));
    bool open = options->cover == NULL;
    for (uint32_t i = 0; open && i < ATTEMPTS; i++)
        if ((all.whole >> attempts[i].cover & 1) == 0)
            open = decide_with(&all, composition, options, attempts[i]);
    printf("{\"result\": {\"outcome\": \"%s\", \"why\": \"%s\", \"states\": %" PRIu32 ", \"zones\": %" PRIu64
           ", \"bytes\": %zu, \"most_discrete\": %.0f, \"temporal\": [",
           fsm_outcome_name(all.outcome), all.why, all.states, all.zones, all.bytes,
           all.most_discrete < 1e15 ? all.most_discrete : 1e15);
    for (uint32_t i = 0; i < options->temporal_count; i++) {
        fsm_timed_answer *answer = &all.answers[i];
        printf("%s{\"known\": %s, \"why\": \"%s\", \"violated\": %s", i == 0 ? "" : ", ",
               answer->known ? "true" : "false", answer->why, answer->lasso.violated ? "true" : "false");
        print_path("path", &answer->lasso.path);
        print_path("cycle", &answer->lasso.cycle);
        printf("}");
        fsm_lasso_free(&answer->lasso);
    }
    printf("]}}\n");
    free(all.answers);
    return 0;
}
