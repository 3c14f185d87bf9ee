/* fsm_io_map_posix.c: a window of registers that is a file, or memory of the machine. */
#define _FILE_OFFSET_BITS 64
#define _POSIX_C_SOURCE 200809L
#include "fsm_io_map.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

int fsm_io_map_open(fsm_io_map *self, const char *path, uint64_t from)
{
    struct stat about;
    void *window;
    int error = 0;
    const int file = open(path, O_RDWR | O_SYNC | O_CLOEXEC);
    if (file < 0) {
        return errno;
    }
    if (!fsm_io_map_fits(self) || from > (uint64_t)INT64_MAX - self->size) {
        error = EINVAL;
    } else if (fstat(file, &about) != 0) {
        error = errno;
    } else if (S_ISREG(about.st_mode) && (uint64_t)about.st_size < from + self->size) {
        error = EINVAL; /* else a signal would come of the first access */
    }
    if (error == 0) {
        window = mmap(NULL, self->size, PROT_READ | PROT_WRITE, MAP_SHARED, file, (off_t)from);
        if (window == MAP_FAILED) {
            error = errno;
        } else {
            self->base = window;
        }
    }
    (void)close(file); /* the window stays */
    return error;
}

void fsm_io_map_close(fsm_io_map *self)
{
    if (self->base != NULL) {
        (void)munmap((void *)(uintptr_t)self->base, self->size);
    }
    self->base = NULL;
}
