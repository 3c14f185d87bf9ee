/* What one charger of this board is: the vendor's data, and the machine among them. */
#ifndef BOARD_H
#define BOARD_H

#include "bms.h"
#include "charger.h"
#include "hal_gpio.h"

typedef enum { BOARD_NOTHING, BOARD_CHARGED, BOARD_HOT, BOARD_LOST } board_notice;

struct board {
    bms_frame frame; /* read by the program before each cycle */
    bms_frame last;
    struct {
        uint8_t level; /* per cent */
    } pwm;
    board_notice notice;
    charger machine;
};

void board_notify(struct board *board, board_notice notice);
void board_show(struct board *board, bms_status fault);

#endif
