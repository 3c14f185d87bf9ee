/* The program of the board: it reads the chip, and runs the machine, ten times a second. */
#include <stdio.h>

#include "board.h"
#include "charger_bind.h"

void board_notify(struct board *board, board_notice notice)
{
    board->notice = notice;
}

void board_show(struct board *board, bms_status fault)
{
    (void)board;
    printf("fault %d\n", (int)fault);
}

int main(void)
{
    static struct board board;
    charger_init(&board.machine);
    charger_start(&board.machine, 0u);
    charger_post_plug(&board.machine);
    for (uint32_t now = 0u; now <= 700u; now += 100u) {
        bms_read(BMS_CHANNEL_1, &board.frame);
        const unsigned rejected = charger_cycle(&board.machine, now);
        printf("%3u ms: %2u.%u A, relay %s, level %3u, rejected %u%s\n", (unsigned)now,
               board.frame.amps / 10u, board.frame.amps % 10u,
               HAL_GPIO_ReadPin(GPIOB, GPIO_PIN_4) == GPIO_PIN_SET ? "on" : "off",
               board.pwm.level, rejected, board.notice == BOARD_CHARGED ? ", charged" : "");
    }
    return 0;
}
