/* can_player.c: for each record on the standard input, `number, length, 64 bytes`, the result of the
 * decoder, the payload, whether it is encoded again, and the bytes of that. */
#include "tables.h"

#include <stdio.h>
#include <string.h>

int main(void)
{
    uint8_t record[2u + FSM_CAN_BYTES];
    while (fread(record, 1u, sizeof record, stdin) == sizeof record) {
        uint8_t answer[2u + 2u * FSM_CAN_BYTES];
        const fsm_can_message *message = &messages[record[0]];
        memset(answer, 0, sizeof answer);
        answer[0] = (uint8_t)fsm_can_decode(message, record + 2, record[1], answer + 2);
        if (answer[0] == FSM_CAN_TAKEN)
            answer[1] = fsm_can_encode(message, answer + 2, answer + 2u + FSM_CAN_BYTES) ? 1u : 0u;
        (void)fwrite(answer, 1u, sizeof answer, stdout);
    }
    return 0;
}
