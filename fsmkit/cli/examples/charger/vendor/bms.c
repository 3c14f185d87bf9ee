/* The driver on a desk: a pack that takes as much current as it lacks charge, and gets warm. */
#include "bms.h"

static uint16_t current;
static int16_t temperature = 215;
static uint16_t missing = 800;

void bms_set(bms_channel channel, float amps)
{
    (void)channel;
    current = (uint16_t)(amps * 10.0f);
}

bms_status bms_state(bms_channel channel)
{
    return channel == BMS_CHANNEL_1 ? BMS_OK : BMS_LOST;
}

void bms_read(bms_channel channel, bms_frame *frame)
{
    const uint16_t taken = current < missing ? current : missing;
    (void)channel;
    missing = (uint16_t)(missing - taken);
    temperature = (int16_t)(temperature + taken / 32);
    frame->temp_dc = temperature;
    frame->amps = taken & 0x3FFu;
    frame->is_valid = 1u;
}
