/* A loop with the machine @{prefix}: replace what its operations do.
 * It belongs to whoever generated it, without any condition. */
#include "esp_timer.h"
#include "freertos/FreeRTOS.h"
#include "freertos/task.h"
@{declarations}

@{stubs}
void app_main(void)
{
    @{start}
    for (;;) {
        @{loop}
        vTaskDelay(1);
    }
}
