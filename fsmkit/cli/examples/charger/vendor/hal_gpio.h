/* A small part of the pins of a vendor's hardware abstraction layer. */
#ifndef HAL_GPIO_H
#define HAL_GPIO_H

#include <stdint.h>

typedef struct {
    volatile uint32_t IDR;
    volatile uint32_t BSRR;
} GPIO_TypeDef;

typedef enum { GPIO_PIN_RESET = 0, GPIO_PIN_SET } GPIO_PinState;

#define GPIO_PIN_3 ((uint16_t)0x0008)
#define GPIO_PIN_4 ((uint16_t)0x0010)

extern GPIO_TypeDef hal_gpio_a;
extern GPIO_TypeDef hal_gpio_b;
#define GPIOA (&hal_gpio_a)
#define GPIOB (&hal_gpio_b)

GPIO_PinState HAL_GPIO_ReadPin(const GPIO_TypeDef *port, uint16_t pin);
void HAL_GPIO_WritePin(GPIO_TypeDef *port, uint16_t pin, GPIO_PinState state);

#endif
