/* FreeRTOS.h: stand-in for what the documentation uses of FreeRTOS, over a simulated clock. */
#ifndef INC_FREERTOS_H
#define INC_FREERTOS_H

#include "standin.h"

typedef long BaseType_t;
typedef unsigned long UBaseType_t;
typedef uint32_t TickType_t;
typedef uint32_t StackType_t;
typedef standin_queue StaticQueue_t;
typedef struct {
    int unused;
} StaticTask_t;

#define pdFALSE ((BaseType_t)0)
#define pdTRUE ((BaseType_t)1)
#define pdPASS pdTRUE
#define errQUEUE_EMPTY ((BaseType_t)0)
#define errQUEUE_FULL ((BaseType_t)0)
#define portMAX_DELAY ((TickType_t)0xffffffffUL)
#define portYIELD_FROM_ISR(woken) standin_yield(woken)
#define configTICK_RATE_HZ ((TickType_t)1000)
#define configMINIMAL_STACK_SIZE ((unsigned short)128)

void standin_yield(BaseType_t woken);

#endif
