#include "report.h"
#include "zones/timed_main.h"
#include "zones/timed_temporal.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static fsm_timed_answer decide(fsm_timed_model *model, fsm_search *search, bool timeless, const char *option,
                               const char *argument)
{
    char *end;
    uint32_t first = (uint32_t)strtoul(argument, &end, 10);
    uint32_t second = *end == ',' ? (uint32_t)strtoul(end + 1, NULL, 10) : 0;
    if (search->outcome != FSM_COMPLETE)
        return (fsm_timed_answer){.why = ""};
    return strcmp(option, "--recoverable") == 0 ? fsm_timed_recoverable(model, search, first)
                                                : fsm_timed_leads_to(model, search, first, second, timeless);
}

static void print_path(const char *name, const fsm_path *path)
{
    printf(", \"%s\": [", name);
    for (size_t i = 0; i < path->count; i++)
        printf("%s%" PRId32, i == 0 ? "" : ", ", (int32_t)path->steps[i]);
    printf("]");
}

int fsm_timed_decide(fsm_composition *composition, const fsm_timed_options *options)
{
    fsm_timed_model model;
    fsm_search search;
    fsm_timed_answer *found = calloc(options->temporal_count, sizeof *found);
    if (found == NULL || !fsm_timed_model_init(&model, composition, options->memory)
        || !fsm_search_init(&search, &model.model, options->memory))
        return FSM_NO_MEMORY;
    search.keep_on = fsm_keep_pace;
    search.seeks_on = fsm_seek_on;
    search.context = options->pace;
    options->pace->counted = &model.timed.tuples.count;
    fsm_search_run(&search);
    if (search.outcome == FSM_MODEL_FAILED && model.failure != NULL)
        search.outcome = FSM_OUT_OF_MEMORY; /* that is all that fails of the model itself */
    for (uint32_t i = 0; i < options->temporal_count; i++)
        found[i] = decide(&model, &search, options->timeless, options->temporal[2 * i], options->temporal[2 * i + 1]);
    const char *why = model.model.failure(&model);
    printf("{\"result\": {\"outcome\": \"%s\", \"why\": \"%s\", \"states\": %" PRIu32 ", \"zones\": %" PRIu64
           ", \"bytes\": %zu, \"temporal\": [",
           fsm_outcome_name(search.outcome), why == NULL ? "" : why, model.timed.tuples.count, search.passed.count,
           fsm_search_bytes(&search));
    for (uint32_t i = 0; i < options->temporal_count; i++) {
        fsm_lasso *lasso = &found[i].lasso;
        printf("%s{\"known\": %s, \"why\": \"%s\", \"violated\": %s", i == 0 ? "" : ", ",
               found[i].known ? "true" : "false", found[i].why, lasso->violated ? "true" : "false");
        print_path("path", &lasso->path);
        print_path("cycle", &lasso->cycle);
        printf("}");
        fsm_lasso_free(lasso);
    }
    printf("]}}\n");
    free(found);
    fsm_search_free(&search);
    fsm_timed_model_free(&model);
    return 0;
}
