/* mps2_an385.h: the board Arm MPS2 with image AN385, a Cortex-M3; `qemu-system-arm -M mps2-an385`.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 * The vectors call main after reset. A program defines the handlers that it needs: TIMER0_Handler,
 * TIMER1_Handler, IRQ31_Handler ... Any other interrupt, and any fault, ends the program. */
#ifndef MPS2_AN385_H
#define MPS2_AN385_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { MPS2_CLOCK_HZ = 25000000, MPS2_TIMER0 = 8, MPS2_TIMER1 = 9, MPS2_SPARE_INTERRUPT = 31 };

/* Write to the first serial port. */
void mps2_put(char byte);
void mps2_print(const char *text);
void mps2_print_number(uint32_t number);

/* Have TIMER0_Handler called every so many cycles; it must call mps2_timer0_clear. */
void mps2_timer0_start(uint32_t cycles);
void mps2_timer0_clear(void);

/* End the program by semihosting: an emulator or a debugger must listen. */
void mps2_exit(int status);

#ifdef __cplusplus
}
#endif

#endif
