#include "system/saved_locals.h"

#include "fsm_bytes.h"
#include "fsm_save.h"
#include "system/composition.h"

#include <stdio.h>
#include <stdlib.h>

static const char *shown_machines;

void fsm_show_locals(const char *machines)
{
    shown_machines = machines;
}

static bool is_shown(uint32_t machine)
{
    const char *at = shown_machines;
    while (at != NULL && *at != '\0') {
        char *end;
        if (strtoul(at, &end, 10) == machine)
            return true;
        at = *end == ',' ? end + 1 : "";
    }
    return false;
}

void fsm_print_saved_locals(const fsm_composition *composition, uint32_t machine)
{
    const fsm_machine_info *info = composition->system->machines[machine]->info;
    if (!is_shown(machine) || info->head == NULL)
        return;
    size_t size = FSM_SAVED_HEAD + info->saved_size + FSM_SAVED_CRC;
    for (uint32_t i = 0; i < info->slot_count; i++)
        size += info->slots[i].info->saved_size;
    uint8_t *bytes = malloc(size);
    if (bytes == NULL)
        return;
    printf(", \"saved\": [");
    for (uint32_t local = 0; local < composition->locals[machine].count; local++) {
        (void)fsm_save(info, fsm_store_at(&composition->locals[machine], local), 0u, bytes); /* not within a step */
        printf("%s\"", local == 0 ? "" : ", ");
        for (size_t i = 0; i < size; i++)
            printf("%02x", (unsigned)bytes[i]);
        printf("\"");
    }
    printf("]");
    free(bytes);
}
