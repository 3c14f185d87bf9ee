/* The pins on a desk: the pack is there, and what is written is kept. */
#include "hal_gpio.h"

GPIO_TypeDef hal_gpio_a = {GPIO_PIN_3, 0u};
GPIO_TypeDef hal_gpio_b = {0u, 0u};

GPIO_PinState HAL_GPIO_ReadPin(const GPIO_TypeDef *port, uint16_t pin)
{
    return (port->IDR & pin) != 0u ? GPIO_PIN_SET : GPIO_PIN_RESET;
}

void HAL_GPIO_WritePin(GPIO_TypeDef *port, uint16_t pin, GPIO_PinState state)
{
    port->IDR = state == GPIO_PIN_SET ? port->IDR | pin : port->IDR & ~(uint32_t)pin;
}
