/* plan.c: when the button of the documentation's lamp is pressed, and what the lamp does. */
#include "lamp.h"
#include "standin.h"

#include <stdio.h>

static const uint32_t presses[] = {100, 130, 400, 400, 430, 1000};
static size_t pressed;

/* Defined on the page; Zephyr's has a parameter. */
#ifdef FREERTOS
void button_isr(void);
#else
void button_isr(const void *unused);
#endif

bool standin_next(uint32_t *at)
{
    if (pressed == sizeof presses / sizeof presses[0])
        return false;
    *at = presses[pressed];
    return true;
}

void standin_happen(void)
{
    pressed++;
#ifdef FREERTOS
    button_isr();
#else
    button_isr(NULL);
#endif
}

void lamp_relay(lamp *m, bool on)
{
    (void)m;
    printf("%lu %s\n", (unsigned long)standin_now(), on ? "on" : "off");
}
