/* A loop with the machine @{prefix}: replace what its operations do.
 * It belongs to whoever generated it, without any condition. */
#include <Arduino.h>
@{declarations}

extern "C" {

@{stubs}
}

void setup()
{
    @{start}
}

void loop()
{
    @{loop}
}
