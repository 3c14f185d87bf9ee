/* freertos.c: the stand-in for FreeRTOS. */
#include "FreeRTOS.h"
#include "queue.h"
#include "task.h"

#include <stdio.h>
#include <stdlib.h>

static TaskFunction_t task_code;
static void *task_parameters;
static BaseType_t to_wake;

static void must(bool what, const char *text)
{
    if (!what) {
        printf("wrong: %s\n", text);
        exit(1);
    }
}

QueueHandle_t xQueueCreateStatic(UBaseType_t length, UBaseType_t size, uint8_t *storage,
                                 StaticQueue_t *buffer)
{
    buffer->slots = (char *)storage;
    buffer->room = length;
    buffer->size = size;
    buffer->first = buffer->count = 0;
    return buffer;
}

BaseType_t xQueueSendFromISR(QueueHandle_t queue, const void *item, BaseType_t *woken)
{
    *woken = to_wake = pdTRUE;
    return standin_put(queue, item) ? pdPASS : errQUEUE_FULL;
}

void standin_yield(BaseType_t woken)
{
    must(woken == to_wake, "an interrupt yields as the queue said");
}

BaseType_t xQueueReceive(QueueHandle_t queue, void *item, TickType_t wait)
{
    return standin_get(queue, item, wait == portMAX_DELAY ? UINT64_MAX : wait) ? pdPASS
                                                                              : errQUEUE_EMPTY;
}

TaskHandle_t xTaskCreateStatic(TaskFunction_t code, const char *name, uint32_t depth,
                               void *parameters, UBaseType_t priority, StackType_t *stack,
                               StaticTask_t *task)
{
    must(name != NULL && depth >= configMINIMAL_STACK_SIZE && priority > 0, "the task's figures");
    must(stack != NULL && task != NULL, "the task's memory");
    task_code = code;
    task_parameters = parameters;
    return NULL;
}

TickType_t xTaskGetTickCount(void)
{
    return standin_now();
}

void vTaskStartScheduler(void)
{
    task_code(task_parameters);
}
