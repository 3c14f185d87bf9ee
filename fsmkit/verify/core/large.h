/* Included before the code of large machines: gcc threads jumps in time that grows with the square
 * of the cases of a `switch` (a minute and a half for 30,000 states), and tables gain nothing by it. */
#ifndef FSM_LARGE_H
#define FSM_LARGE_H
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("no-thread-jumps")
#endif
#endif
