/* value_player.c: values of messages in the payloads of frames, by the tables; test_c_carrier.py. */
#include "cell_b_dds.h"

#include "std_msgs_Int32_.h"
#include "std_msgs_Int64_.h"

#include <stdio.h>
#include <string.h>

#define CHECK(is_so)                                                                               \
    do {                                                                                           \
        if (!(is_so)) {                                                                            \
            printf("line %d: %s\n", __LINE__, #is_so);                                             \
            return 1;                                                                              \
        }                                                                                          \
    } while (0)

static const fsm_link_dds_wire *wire_of(const char *name)
{
    for (unsigned place = 0u; place < cell_b_dds_vision.wire_count; place++) {
        const fsm_link_dds_wire *wire = &cell_b_dds_vision.wire[place];
        if (strcmp(cell_b_dds_vision.topic[wire->topic].name, name) == 0)
            return wire;
    }
    return NULL;
}

int main(void)
{
    const fsm_link_dds_wire *light = wire_of("rt/light"), *verdict = wire_of("rt/verdict");
    const fsm_link_dds_wire *belt = wire_of("rt/belt");
    fsm_ros_numbers numbers = {0u, 0u, 0u};
    uint8_t p[16] = {0u};
    std_msgs_msg_dds__Int64_ wide;
    std_msgs_msg_dds__Int32_ half;
    int32_t sec;
    uint32_t nanosec;
    CHECK(light != NULL && verdict != NULL && belt != NULL);
    CHECK(light->unpack != NULL && light->publish == NULL && belt->publish != NULL);
    CHECK(light->size == 2u && belt->size == 4u);
    CHECK(cell_b_dds_vision.topic[belt->topic].qos == FSM_ROS_SENSOR);

    wide.data = 1000;
    CHECK(light->unpack(&wide, p, &numbers) && p[0] == 0xe8u && p[1] == 0x03u && p[2] == 0u);
    wide.data = 65536; /* has no place: would be 0 */
    CHECK(!light->unpack(&wide, p, &numbers) && p[0] == 0xe8u);
    wide.data = -1;
    CHECK(!light->unpack(&wide, p, &numbers));
    half.data = 1; /* two values of one field */
    CHECK(verdict->unpack(&half, p, &numbers) && p[0] == 1u && p[1] == 1u);
    half.data = 256;
    CHECK(!verdict->unpack(&half, p, &numbers));
    half.data = -255;
    CHECK(!verdict->unpack(&half, p, &numbers));

    CHECK(fsm_ros_ticks(2, 500000000u, 1000) == 2500);
    CHECK(fsm_ros_ticks(2, 999999u, 1000) == 2000);
    CHECK(fsm_ros_ticks(-1, 999999999u, 1000) == -1);
    CHECK(fsm_ros_ticks(INT32_MIN, 0u, 1) == INT64_C(-2147483648000000));
    fsm_ros_split(INT64_C(2500001), &sec, &nanosec);
    CHECK(sec == 2 && nanosec == 500001000u);
    fsm_ros_split(INT64_C(2147483648000000), &sec, &nanosec);
    CHECK(sec == INT32_MAX && nanosec == 999999999u);
    CHECK(fsm_ros_is_float(3.4028234663852886e38) && !fsm_ros_is_float(3.5e38));
    CHECK(!fsm_ros_is_float(-1e300));
    return 0;
}
