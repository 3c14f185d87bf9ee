/* board_player.h: what plays a script on the board: SysTick is the clock, and events are posted by
 * an interrupt. */
#ifndef BOARD_PLAYER_H
#define BOARD_PLAYER_H

#include "cortex_m/fsm_cortex_m.h"
#include "fsm_mailbox.h"

#include <stdint.h>

/* Start the clock at that time. */
uint32_t board_start(uint32_t now);

/* Sleep until the clock shows that time; return what it shows. */
uint32_t board_wait(uint32_t now);

/* Call a function in the handler of an interrupt. */
void board_interrupt(void (*handler)(void));

#endif
