/* fsm_ros_values.h: what all carriers of ROS 2 have in common; freestanding.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#ifndef FSM_ROS_VALUES_H
#define FSM_ROS_VALUES_H

#include <stdbool.h>
#include <stdint.h>

typedef enum {
    FSM_ROS_DEFAULT, /* reliable, volatile */
    FSM_ROS_STATE,   /* reliable, the last is kept for who comes late */
    FSM_ROS_SENSOR   /* best effort */
} fsm_ros_qos;

/* The header of event messages, before their fields. */
typedef struct {
    uint32_t session, sequence, events;
} fsm_ros_numbers;

/* For generated code. */

/* Whether a double has a float: all but those that are finite and greater than any float. */
static inline bool fsm_ros_is_float(double value)
{
    return (value <= 3.4028234663852886e38 && value >= -3.4028234663852886e38) ||
           value - value != 0.0;
}

/* The whole ticks that have passed after a duration; `tick`: in microseconds. */
static inline int64_t fsm_ros_ticks(int32_t sec, uint32_t nanosec, int64_t tick)
{
    int64_t ns = (int64_t)sec * 1000000000 + (int64_t)nanosec, size = tick * 1000;
    return ns / size - (ns % size < 0 ? 1 : 0);
}

/* A span of time as ROS has it; one that is too long is the longest. */
static inline void fsm_ros_split(int64_t us, int32_t *sec, uint32_t *nanosec)
{
    bool fits = us / 1000000 <= INT32_MAX;
    *sec = fits ? (int32_t)(us / 1000000) : INT32_MAX;
    *nanosec = fits ? (uint32_t)(us % 1000000) * 1000u : 999999999u;
}

#endif
