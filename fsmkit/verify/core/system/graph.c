#include "system/graph.h"

#include "system/composition.h"
#include "report.h"
#include "system/tree.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

static void print_numbers(const fsm_composition *self, uint32_t first, uint32_t count)
{
    printf("[");
    for (uint32_t i = 0; i < count; i++)
        printf("%s%" PRIu32, i == 0 ? "" : ",", self->numbers.items[first + i]);
    printf("]");
}

static void print_steps(const fsm_composition *self, bool known, uint32_t first, uint32_t count)
{
    if (!known) {
        printf("null");
        return;
    }
    printf("[");
    for (uint32_t i = first; i < first + count; i++) {
        const fsm_local_step *step = &self->steps[i];
        printf("%s[\"%s\",%" PRIu32 ",", i == first ? "" : ",", fsm_action_name(step->action), step->argument);
        print_numbers(self, step->choices, step->choice_count);
        printf(",%" PRIu32 ",", step->next);
        print_numbers(self, step->messages, step->message_count);
        printf("]");
    }
    printf("]");
}

static void print_locals(const fsm_composition *self, uint32_t machine)
{
    printf("[");
    for (uint32_t i = 0; i < self->locals[machine].count; i++) {
        const fsm_local_info *info = fsm_info(self, machine, i);
        printf("%s[", i == 0 ? "" : ",");
        print_steps(self, info->known, info->own, info->own_count);
        printf(",");
        print_steps(self, info->open_known, info->open, info->open_count);
        if (info->elapsed == FSM_NONE)
            printf(",null]");
        else
            printf(",%" PRIu32 "]", info->elapsed);
    }
    printf("]");
}

static void print_deliveries(const fsm_composition *self)
{
    const fsm_hash_map_table *table = self->deliveries.table;
    bool first = true;
    printf("[");
    for (size_t i = 0; table != NULL && i < table->capacity; i++) {
        const fsm_hash_map_slot *slot = &table->slots[i];
        if (slot->key == 0)
            continue;
        uint32_t local = (uint32_t)((slot->key - 1) >> 32), message = (uint32_t)(slot->key - 1);
        const fsm_message *what = fsm_store_at(&self->messages, message);
        printf("%s[%" PRIu32 ",%" PRIu32 ",%" PRIu32 ",%" PRIu32 "]", first ? "" : ",", what->target, local,
               message, (uint32_t)(slot->value >> 1));
        first = false;
    }
    printf("]");
}

static void print_starts(const fsm_composition *self)
{
    const fsm_model *model = &self->model;
    fsm_steps steps = {0};
    printf("[");
    bool known = model->initial(model->self, &steps);
    for (size_t i = 0; known && i < steps.count; i++) {
        uint32_t locals[FSM_MOST_MACHINES];
        fsm_tree_unfold(self->tree, steps.items[i].to, locals);
        printf("%s[", i == 0 ? "" : ",");
        for (uint32_t m = 0; m < self->system->machine_count; m++)
            printf("%s%" PRIu32, m == 0 ? "" : ",", locals[m]);
        printf("]");
    }
    printf("]");
    free(steps.items);
}

void fsm_print_graph(fsm_composition *self)
{
    printf(", \"graph\": {\"starts\": ");
    print_starts(self);
    printf(", \"locals\": [");
    for (uint32_t i = 0; i < self->system->machine_count; i++) {
        printf("%s", i == 0 ? "" : ", ");
        print_locals(self, i);
    }
    printf("], \"deliveries\": ");
    print_deliveries(self);
    printf("}");
}
