/* board_player.c: see board_player.h; and the system calls for newlib: standard input is the
 * script that is linked in, standard output the serial port. */
#include "board_player.h"
#include "cortex_m/mps2_an385.h"

#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <sys/stat.h>

enum { CYCLES_A_TICK = MPS2_CLOCK_HZ / 1000 };

extern const char script[];
extern const size_t script_length;
extern char end[]; /* of the linker script: the start of the heap */

int play(void); /* the main of the harness */
void IRQ31_Handler(void);
int _read(int file, char *to, int length);
int _write(int file, const char *from, int length);
void *_sbrk(ptrdiff_t more);
int _close(int file);
int _fstat(int file, struct stat *status);
int _isatty(int file);
int _lseek(int file, int offset, int whence);
int _kill(int process, int signal_number);
int _getpid(void);
void _exit(int status);
void _fini(void);

static void (*handle)(void);
static volatile unsigned posted;
static unsigned asked;
static unsigned slept;

uint32_t board_start(uint32_t now)
{
    fsm_cortex_m_enable(MPS2_SPARE_INTERRUPT);
    fsm_cortex_m_start(CYCLES_A_TICK, now);
    return now;
}

/* By wfi, which lets the emulator skip the time; masked, so that no tick comes before it sleeps. */
uint32_t board_wait(uint32_t now)
{
    __asm__ volatile("cpsid i" ::: "memory");
    while ((uint32_t)(fsm_cortex_m_now() - now) >= UINT32_C(0x80000000)) {
        __asm__ volatile("wfi\n\tcpsie i\n\tisb\n\tcpsid i" ::: "memory");
        slept++;
    }
    __asm__ volatile("cpsie i" ::: "memory");
    return fsm_cortex_m_now();
}

void IRQ31_Handler(void)
{
    handle();
    posted++;
}

void board_interrupt(void (*handler)(void))
{
    handle = handler;
    asked++;
    fsm_cortex_m_pend(MPS2_SPARE_INTERRUPT);
    if (posted != asked) {
        fputs("the interrupt did not come\n", stdout);
        _exit(1);
    }
}

int _read(int file, char *to, int length)
{
    static size_t at;
    int count = 0;
    (void)file;
    while (count < length && at < script_length)
        to[count++] = script[at++];
    return count;
}

int _write(int file, const char *from, int length)
{
    (void)file;
    for (int i = 0; i < length; i++)
        mps2_put(from[i]);
    return length;
}

void *_sbrk(ptrdiff_t more)
{
    static char *top = end;
    char *before = top;
    top += more;
    return before;
}

int _close(int file)
{
    (void)file;
    return 0;
}

int _fstat(int file, struct stat *status)
{
    (void)file;
    status->st_mode = S_IFCHR;
    return 0;
}

int _isatty(int file)
{
    (void)file;
    return 0;
}

int _lseek(int file, int offset, int whence)
{
    (void)file;
    (void)offset;
    (void)whence;
    return 0;
}

int _kill(int process, int signal_number)
{
    (void)process;
    (void)signal_number;
    errno = EINVAL;
    return -1;
}

int _getpid(void)
{
    return 1;
}

void _fini(void)
{
}

void _exit(int status)
{
    mps2_exit(status);
    for (;;) {
    }
}

/* Play, and say how the clock and the interrupt were used. */
int main(void)
{
    int status = play();
    printf("ticks slept %u, events posted by interrupt %u\n", slept, posted);
    (void)fflush(stdout);
    return status;
}
