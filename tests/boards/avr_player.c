/* avr_player.c: what the harness lacks on an AVR: standard input is the script that is linked in, in
 * flash; standard output is a register that simavr prints; the end is sleep that nothing ends. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <simavr/avr/avr_mcu_section.h>

AVR_MCU(F_CPU, MCU);
AVR_MCU_SIMAVR_CONSOLE(&GPIOR0);

extern const char script[];
extern const size_t script_length;
extern uint8_t __heap_start; /* of the linker script: behind all static memory */

int play(void); /* the main of the harness */
void stop(int status);
void paint(void) __attribute__((naked, used, section(".init3")));

enum { PAINT = 0xA5 };

/* Before anything is on the stack: what is still painted at the end was never used. */
void paint(void)
{
    for (uint8_t *p = &__heap_start; p < (uint8_t *)RAMEND; p++)
        *p = PAINT;
}

/* Return the longest part that was never used, between the heap and the stack. */
static uint16_t unused(void)
{
    uint16_t most = 0, length = 0;
    for (const uint8_t *p = &__heap_start; p < (const uint8_t *)RAMEND; p++) {
        length = *p == PAINT ? (uint16_t)(length + 1u) : 0u;
        most = length > most ? length : most;
    }
    return most;
}

/* The simulator shows a line when a carriage return comes. */
static int show(char c, FILE *stream)
{
    (void)stream;
    GPIOR0 = c == '\n' ? '\r' : (uint8_t)c;
    return 0;
}

static int next(FILE *stream)
{
    static size_t at;
    (void)stream;
    return at < script_length ? (int)pgm_read_byte(&script[at++]) : _FDEV_EOF;
}

void stop(int status)
{
    printf("status %d, bytes of memory never used %u\n", status, unused());
    cli();
    sleep_enable();
    for (;;)
        sleep_cpu();
}

int main(void)
{
    static FILE out = FDEV_SETUP_STREAM(show, NULL, _FDEV_SETUP_WRITE);
    static FILE in = FDEV_SETUP_STREAM(NULL, next, _FDEV_SETUP_READ);
    stdout = stderr = &out;
    stdin = &in;
    stop(play());
}
