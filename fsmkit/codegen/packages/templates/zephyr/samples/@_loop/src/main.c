/* A loop with the machine @{prefix}: replace what its operations do.
 * It belongs to whoever generated it, without any condition. */
#include <zephyr/kernel.h>
@{declarations}

@{stubs}
int main(void)
{
    @{start}
    for (;;) {
        @{loop}
        k_msleep(1);
    }
    return 0;
}
