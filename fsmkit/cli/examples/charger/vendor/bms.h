/* A driver of a battery management chip, as its vendor hands it out. */
#ifndef BMS_H
#define BMS_H

#include <stdint.h>

#define BMS_AMPS_MAX 320u     /* tenths of an ampere */
#define BMS_TEMP_MAX_DC (450) /* tenths of a degree Celsius */

typedef enum { BMS_OK, BMS_HOT, BMS_LOST } bms_status;
typedef enum { BMS_CHANNEL_1 = 1, BMS_CHANNEL_2 } bms_channel;

typedef struct {
    int16_t temp_dc;
    uint16_t amps : 10;
    uint16_t is_valid : 1;
} bms_frame;

void bms_set(bms_channel channel, float amps);
bms_status bms_state(bms_channel channel);
void bms_read(bms_channel channel, bms_frame *frame);

#endif
