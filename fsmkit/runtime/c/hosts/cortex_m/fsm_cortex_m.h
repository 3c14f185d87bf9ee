/* fsm_cortex_m.h: machines on a bare Cortex-M, with SysTick as their clock.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms.
 *
 *   void TIMER0_Handler(void)   { feeder_mailbox_put(&box, &event); fsm_cortex_m_wake(); }
 *   static void step(void *context, uint32_t now)   { feeder_mailbox_run(&box, context, now); }
 *
 *   feeder_start(&machine, 0);
 *   fsm_cortex_m_start(25000u, 0);          25 MHz, a tick of 1 ms; time is 0 now
 *   fsm_cortex_m_loop(step, &machine);
 *
 * Interrupts post by a mailbox (fsm_mailbox.h), then wake the loop. Defines
 * SysTick_Handler. Needs no C library. */
#ifndef FSM_CORTEX_M_H
#define FSM_CORTEX_M_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Run all machines until `now`, in ticks modulo 2^32. */
typedef void (*fsm_cortex_m_step)(void *context, uint32_t now);

/* Count ticks of that many cycles of the processor's clock, at most 2^24, from a time on. */
void fsm_cortex_m_start(uint32_t cycles, uint32_t now);

/* The time in ticks, modulo 2^32. */
uint32_t fsm_cortex_m_now(void);

/* From an interrupt, after it put an event into a mailbox: end the sleep. */
void fsm_cortex_m_wake(void);

/* Sleep until the next tick or wake, or not at all if there was one since the last sleep. */
void fsm_cortex_m_sleep(void);

/* Call `step` at every tick and wake, and sleep in between. Does not return. */
void fsm_cortex_m_loop(fsm_cortex_m_step step, void *context);

/* Return the number of ticks without a start of `step`, because the last one was not finished. */
uint32_t fsm_cortex_m_missed(void);

/* Make an interrupt of the board possible; have it happen as soon as it can. */
void fsm_cortex_m_enable(unsigned interrupt);
void fsm_cortex_m_pend(unsigned interrupt);

/* Hold all interrupts back, and let them be as they were (Armv7-M, B5.2.3: PRIMASK). It nests. For
 * a mailbox that interrupts of several priorities fill; before fsm_mailbox.h:
 *
 *   #define FSM_ENTER_CRITICAL() const uint32_t mask_ = fsm_cortex_m_mask()
 *   #define FSM_EXIT_CRITICAL() fsm_cortex_m_unmask(mask_) */
static inline uint32_t fsm_cortex_m_mask(void)
{
    uint32_t mask;
    __asm__ volatile("mrs %0, primask\n\tcpsid i" : "=r"(mask)::"memory");
    return mask;
}

static inline void fsm_cortex_m_unmask(uint32_t mask)
{
    __asm__ volatile("msr primask, %0" ::"r"(mask) : "memory");
}

#ifdef __cplusplus
}
#endif

#endif
