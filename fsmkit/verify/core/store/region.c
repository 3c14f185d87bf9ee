#define _DEFAULT_SOURCE
#include "store/region.h"

#include <stdint.h>

#include <sys/mman.h>

#ifndef MAP_NORESERVE
#define MAP_NORESERVE 0
#endif

enum { LEAST = 1 << 20, PAGE = 4096 };

void fsm_region_advise(void *memory, size_t bytes)
{
#ifdef MADV_HUGEPAGE
    size_t skipped = (PAGE - (uintptr_t)memory % PAGE) % PAGE;
    if (bytes > LEAST)
        (void)madvise((char *)memory + skipped, bytes - skipped, MADV_HUGEPAGE);
#else
    (void)memory;
    (void)bytes;
#endif
}

bool fsm_region_reserve(fsm_region *self, size_t bytes)
{
    size_t most = bytes < LEAST ? LEAST : bytes;
    for (; most >= LEAST; most /= 2) {
        void *base = mmap(NULL, most, PROT_READ | PROT_WRITE,
                          MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
        if (base == MAP_FAILED)
            continue;
        fsm_region_advise(base, most);
        *self = (fsm_region){base, most};
        return true;
    }
    *self = (fsm_region){0};
    return false;
}

void fsm_region_release(fsm_region *self)
{
    if (self->base != NULL)
        (void)munmap(self->base, self->reserved);
    *self = (fsm_region){0};
}
