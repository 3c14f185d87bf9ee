/* time.h: a stand-in for rcutils of ROS 2. */
#ifndef RCUTILS_TIME_H
#define RCUTILS_TIME_H

#include <rcl/rcl.h>

typedef int64_t rcutils_time_point_value_t;

rcl_ret_t rcutils_steady_time_now(rcutils_time_point_value_t *now);

#endif
