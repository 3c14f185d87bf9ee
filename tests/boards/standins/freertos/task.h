/* task.h: stand-in; see FreeRTOS.h. */
#ifndef INC_TASK_H
#define INC_TASK_H

typedef void (*TaskFunction_t)(void *);
typedef struct standin_task *TaskHandle_t;

TaskHandle_t xTaskCreateStatic(TaskFunction_t code, const char *name, uint32_t depth,
                               void *parameters, UBaseType_t priority, StackType_t *stack,
                               StaticTask_t *task);
TickType_t xTaskGetTickCount(void);
void vTaskStartScheduler(void);

#endif
