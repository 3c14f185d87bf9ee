/* Dining philosophers, step by step like philosopher.yaml: build with -DN=8. Everybody takes the fork
 * with the lower number first, so that nobody waits for ever. */
#ifndef N
#define N 8
#endif

bool taken[N];
bool odd[N];

proctype philosopher(byte me)
{
    byte low, high;
    atomic {
        if
        :: me == N - 1 -> low = 0; high = me
        :: else -> low = me; high = me + 1
        fi
    }
    do
    :: atomic { !taken[low] -> taken[low] = true };
       atomic { !taken[high] -> taken[high] = true };
       atomic { odd[me] = !odd[me]; taken[high] = false };
       taken[low] = false
    od
}

init {
    byte i;
    atomic {
        i = 0;
        do
        :: i < N -> run philosopher(i); i++
        :: else -> break
        od
    }
}
