/* fsm_cortex_m.c: see fsm_cortex_m.h. Registers: Armv7-M Architecture Reference Manual, B3.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#include "fsm_cortex_m.h"

#include <stdbool.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define SYSTICK_CONTROL REGISTER(0xE000E010u)
#define SYSTICK_RELOAD REGISTER(0xE000E014u)
#define SYSTICK_CURRENT REGISTER(0xE000E018u)
#define NVIC_ENABLE(word) REGISTER(0xE000E100u + 4u * (word))
#define NVIC_PEND(word) REGISTER(0xE000E200u + 4u * (word))
enum { SYSTICK_ENABLED = 1, SYSTICK_INTERRUPTS = 2, SYSTICK_PROCESSOR_CLOCK = 4 };

void SysTick_Handler(void);

static volatile uint32_t ticks;
static volatile bool woken;
static uint32_t missed;

void SysTick_Handler(void)
{
    ticks++;
    woken = true;
}

void fsm_cortex_m_start(uint32_t cycles, uint32_t now)
{
    SYSTICK_CONTROL = 0u;
    ticks = now;
    missed = 0u;
    SYSTICK_RELOAD = cycles - 1u;
    SYSTICK_CURRENT = 0u;
    SYSTICK_CONTROL = SYSTICK_ENABLED | SYSTICK_INTERRUPTS | SYSTICK_PROCESSOR_CLOCK;
}

uint32_t fsm_cortex_m_now(void)
{
    return ticks;
}

void fsm_cortex_m_wake(void)
{
    woken = true;
}

/* The return from an exception sets the event register (Armv7-M, Wait For Event): wfe does not
 * sleep where an interrupt was served between the test and it. */
void fsm_cortex_m_sleep(void)
{
    while (!woken) {
        __asm__ volatile("wfe" ::: "memory");
    }
    woken = false;
}

void fsm_cortex_m_loop(fsm_cortex_m_step step, void *context)
{
    uint32_t last = fsm_cortex_m_now();
    for (;;) {
        uint32_t now;
        fsm_cortex_m_sleep();
        now = fsm_cortex_m_now();
        if (now - last > 1u) {
            missed += now - last - 1u;
        }
        last = now;
        step(context, now);
    }
}

uint32_t fsm_cortex_m_missed(void)
{
    return missed;
}

void fsm_cortex_m_enable(unsigned interrupt)
{
    NVIC_ENABLE(interrupt / 32u) = UINT32_C(1) << (interrupt % 32u);
}

void fsm_cortex_m_pend(unsigned interrupt)
{
    NVIC_PEND(interrupt / 32u) = UINT32_C(1) << (interrupt % 32u);
    __asm__ volatile("dsb\n\tisb" ::: "memory");
}
