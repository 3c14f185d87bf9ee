/* mps2_an385.c: vectors, start, serial port, timer and end; see mps2_an385.h. Registers as in the
 * Arm Application Note AN385, 4, and the CMSDK Technical Reference Manual, 4.
 *
 * Copyright the fsmkit authors, Apache-2.0. A copy that accompanies generated code may be used,
 * changed and passed on with it under any terms. */
#include "mps2_an385.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define TIMER0_CONTROL REGISTER(0x40000000u)
#define TIMER0_VALUE REGISTER(0x40000004u)
#define TIMER0_RELOAD REGISTER(0x40000008u)
#define TIMER0_CLEAR REGISTER(0x4000000Cu)
#define UART0_DATA REGISTER(0x40004000u)
#define UART0_STATE REGISTER(0x40004004u)
#define UART0_CONTROL REGISTER(0x40004008u)
#define UART0_DIVIDER REGISTER(0x40004010u)
enum { TIMER_ENABLED = 1, TIMER_INTERRUPTS = 8, UART_FULL = 1, UART_SENDS = 1 };
enum { SEMIHOSTING_EXIT = 0x20, APPLICATION_EXIT = 0x20026, UNEXPECTED = 70 };

typedef void (*handler)(void);

/* Defined by the linker script. */
extern uint32_t mps2_stack_top[], mps2_data_image[], mps2_data[], mps2_data_end[];
extern uint32_t mps2_bss[], mps2_bss_end[];

int main(void);
void Reset_Handler(void);
void Default_Handler(void);

void Reset_Handler(void)
{
    const volatile uint32_t *from = mps2_data_image;
    for (volatile uint32_t *to = mps2_data; to < mps2_data_end; to++) {
        *to = *from++;
    }
    for (volatile uint32_t *to = mps2_bss; to < mps2_bss_end; to++) {
        *to = 0u;
    }
    UART0_DIVIDER = 16u;
    UART0_CONTROL = UART_SENDS;
    mps2_exit(main());
}

void Default_Handler(void)
{
    mps2_print("unexpected interrupt or fault\n");
    mps2_exit(UNEXPECTED);
}

#define OTHERWISE_DEFAULT __attribute__((weak, alias("Default_Handler")))
void NMI_Handler(void) OTHERWISE_DEFAULT;
void HardFault_Handler(void) OTHERWISE_DEFAULT;
void MemManage_Handler(void) OTHERWISE_DEFAULT;
void BusFault_Handler(void) OTHERWISE_DEFAULT;
void UsageFault_Handler(void) OTHERWISE_DEFAULT;
void SVC_Handler(void) OTHERWISE_DEFAULT;
void DebugMon_Handler(void) OTHERWISE_DEFAULT;
void PendSV_Handler(void) OTHERWISE_DEFAULT;
void SysTick_Handler(void) OTHERWISE_DEFAULT;
void TIMER0_Handler(void) OTHERWISE_DEFAULT;
void TIMER1_Handler(void) OTHERWISE_DEFAULT;
void IRQ31_Handler(void) OTHERWISE_DEFAULT;

#define FOUR Default_Handler, Default_Handler, Default_Handler, Default_Handler

/* Armv7-M B1.5.3: the first word is the stack; faults and system handlers; 32 interrupts. */
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    handler handlers[47];
} vectors = {
    mps2_stack_top,
    {
        Reset_Handler, NMI_Handler, HardFault_Handler, MemManage_Handler,
        BusFault_Handler, UsageFault_Handler, 0, 0,
        0, 0, SVC_Handler, DebugMon_Handler,
        0, PendSV_Handler, SysTick_Handler,
        FOUR, FOUR,
        TIMER0_Handler, TIMER1_Handler, Default_Handler, Default_Handler,
        FOUR, FOUR, FOUR, FOUR,
        Default_Handler, Default_Handler, Default_Handler, IRQ31_Handler,
    },
};

void mps2_put(char byte)
{
    while ((UART0_STATE & UART_FULL) != 0u) {
    }
    UART0_DATA = (uint32_t)(unsigned char)byte;
}

void mps2_print(const char *text)
{
    while (*text != '\0') {
        mps2_put(*text++);
    }
}

void mps2_print_number(uint32_t number)
{
    if (number >= 10u) {
        mps2_print_number(number / 10u);
    }
    mps2_put((char)('0' + number % 10u));
}

void mps2_timer0_start(uint32_t cycles)
{
    TIMER0_VALUE = cycles - 1u;
    TIMER0_RELOAD = cycles - 1u;
    TIMER0_CONTROL = TIMER_ENABLED | TIMER_INTERRUPTS;
}

void mps2_timer0_clear(void)
{
    TIMER0_CLEAR = 1u;
}

void mps2_exit(int status)
{
    uint32_t block[2];
    block[0] = APPLICATION_EXIT;
    block[1] = (uint32_t)status;
    for (;;) {
        register uint32_t operation __asm__("r0") = SEMIHOSTING_EXIT;
        register uint32_t *argument __asm__("r1") = block;
        __asm__ volatile("bkpt 0xab" : "+r"(operation) : "r"(argument) : "memory");
    }
}
