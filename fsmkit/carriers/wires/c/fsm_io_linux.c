/* fsm_io_linux.c: see fsm_io_linux.h. */
#define _POSIX_C_SOURCE 200809L
#include "fsm_io_linux.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/gpio.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

enum { PATH_ROOM = 256, TEXT_ROOM = 24 };

static int ask_system(int file, unsigned long request, void *argument)
{
    return ioctl(file, request, argument);
}

static bool is_of_file(const fsm_io_wire *wire)
{
    return wire->kind == FSM_IO_ANALOG_IN || wire->kind == FSM_IO_COUNTER ||
           wire->kind == FSM_IO_PWM;
}

/* ---- files ------------------------------------------------------------------------------------- */

static int write_number(int file, uint64_t number)
{
    char text[TEXT_ROOM];
    const int length = snprintf(text, sizeof text, "%llu\n", (unsigned long long)number);
    const ssize_t written = pwrite(file, text, (size_t)length, 0);
    return written == length ? 0 : written < 0 ? errno : EIO;
}

static int read_number(int file, int32_t *number)
{
    char text[TEXT_ROOM], *end;
    long long found;
    const ssize_t length = pread(file, text, sizeof text - 1u, 0);
    if (length < 0) {
        return errno;
    }
    text[length] = '\0';
    errno = 0;
    found = strtoll(text, &end, 10);
    if (end == text || errno != 0) {
        return EIO;
    }
    *number = (int32_t)(uint32_t)((unsigned long long)found & UINT32_MAX); /* a counter wraps */
    return 0;
}

/* Open `folder/name`, in which %u is the number of a wire; -1 and errno. */
static int open_in(const char *folder, const char *before, unsigned number, const char *after,
                   int flags)
{
    char path[PATH_ROOM];
    const int length = snprintf(path, sizeof path, "%s/%s%u%s", folder, before, number, after);
    if (length < 0 || (size_t)length >= sizeof path) {
        errno = ENAMETOOLONG;
        return -1;
    }
    return open(path, flags | O_CLOEXEC);
}

static int set_once(const char *folder, unsigned number, const char *after, uint64_t value)
{
    const int file = open_in(folder, "pwm", number, after, O_WRONLY);
    int error;
    if (file < 0) {
        return errno;
    }
    error = write_number(file, value);
    (void)close(file);
    return error;
}

/* The channel exists: it did before, or it is requested. */
static int export_pwm(const char *folder, unsigned number)
{
    char path[PATH_ROOM];
    int file = open_in(folder, "pwm", number, "/period", O_WRONLY), error;
    if (file >= 0) {
        (void)close(file);
        return 0;
    }
    if (snprintf(path, sizeof path, "%s/export", folder) >= PATH_ROOM) {
        return ENAMETOOLONG;
    }
    file = open(path, O_WRONLY | O_CLOEXEC);
    if (file < 0) {
        return errno;
    }
    error = write_number(file, number);
    (void)close(file);
    return error;
}

static uint64_t duty(const fsm_io_linux *self, const fsm_io_wire *wire, int32_t value)
{
    const int32_t within = fsm_io_clamp(value, 0, wire->full);
    return wire->full > 0 ? (uint64_t)within * self->period_ns / (uint32_t)wire->full : 0u;
}

/* No pulse is longer than its period at any time: the width is 0 while the period changes. */
static int open_pwm(fsm_io_linux *self, const fsm_io_wire *wire, const char *folder)
{
    const unsigned number = wire->number;
    int error = export_pwm(folder, number), file;
    if (error == 0) {
        error = set_once(folder, number, "/duty_cycle", 0u);
    }
    if (error == 0) {
        error = set_once(folder, number, "/period", self->period_ns);
    }
    if (error == 0) {
        error = set_once(folder, number, "/duty_cycle", duty(self, wire, wire->safe));
    }
    if (error == 0) {
        error = set_once(folder, number, "/enable", 1u);
    }
    if (error != 0) {
        errno = error;
        return -1;
    }
    file = open_in(folder, "pwm", number, "/duty_cycle", O_WRONLY);
    return file;
}

static int open_file(fsm_io_linux *self, uint16_t place, const fsm_io_linux_places *places)
{
    const fsm_io_wire *const wire = &self->wires[place];
    const char *const folder = wire->kind == FSM_IO_ANALOG_IN ? places->iio
                               : wire->kind == FSM_IO_COUNTER ? places->counter
                                                              : places->pwm;
    int file;
    if (folder == NULL) {
        return ENODEV;
    }
    if (self->file_count >= FSM_IO_LINUX_FILES) {
        return EMFILE;
    }
    if (wire->kind == FSM_IO_ANALOG_IN) {
        file = open_in(folder, "in_voltage", wire->number, "_raw", O_RDONLY);
    } else if (wire->kind == FSM_IO_COUNTER) {
        file = open_in(folder, "count", wire->number, "/count", O_RDONLY);
    } else {
        file = open_pwm(self, wire, folder);
    }
    if (file < 0) {
        return errno;
    }
    self->files[self->file_count].file = file;
    self->files[self->file_count].wire = place;
    self->file_count++;
    return 0;
}

/* ---- lines ------------------------------------------------------------------------------------- */

static int add_line(fsm_io_linux_lines *lines, uint16_t place)
{
    if (lines->count >= FSM_IO_LINUX_LINES) {
        return EMFILE;
    }
    lines->wires[lines->count++] = place;
    return 0;
}

static int ask_for_lines(fsm_io_linux *self, fsm_io_linux_lines *lines, int chip, bool is_output)
{
    struct gpio_v2_line_request request;
    uint64_t safe = 0u;
    if (lines->count == 0u) {
        return 0;
    }
    memset(&request, 0, sizeof request);
    (void)snprintf(request.consumer, sizeof request.consumer, "fsmkit");
    request.num_lines = lines->count;
    for (uint16_t i = 0; i < lines->count; i++) {
        const fsm_io_wire *const wire = &self->wires[lines->wires[i]];
        request.offsets[i] = wire->number;
        if (wire->safe != 0) {
            safe |= UINT64_C(1) << i;
        }
    }
    request.config.flags = is_output ? GPIO_V2_LINE_FLAG_OUTPUT : GPIO_V2_LINE_FLAG_INPUT;
    if (is_output) {
        request.config.num_attrs = 1u;
        request.config.attrs[0].attr.id = GPIO_V2_LINE_ATTR_ID_OUTPUT_VALUES;
        request.config.attrs[0].attr.values = safe;
        request.config.attrs[0].mask = UINT64_MAX >> (64u - lines->count);
    }
    if (self->ioctl(chip, GPIO_V2_GET_LINE_IOCTL, &request) < 0) {
        return errno;
    }
    lines->file = request.fd;
    return 0;
}

static int open_lines(fsm_io_linux *self, const char *path)
{
    int chip, error;
    if (self->in.count == 0u && self->out.count == 0u) {
        return 0;
    }
    if (path == NULL) {
        return ENODEV;
    }
    chip = open(path, O_RDWR | O_CLOEXEC);
    if (chip < 0) {
        return errno;
    }
    error = ask_for_lines(self, &self->in, chip, false);
    if (error == 0) {
        error = ask_for_lines(self, &self->out, chip, true);
    }
    (void)close(chip); /* the lines stay */
    return error;
}

/* ---- all ----------------------------------------------------------------------------------------- */

static int open_wire(fsm_io_linux *self, uint16_t place, const fsm_io_linux_places *places)
{
    const fsm_io_wire *const wire = &self->wires[place];
    if (is_of_file(wire)) {
        return open_file(self, place, places);
    }
    if (wire->kind == FSM_IO_DIGITAL_IN) {
        return add_line(&self->in, place);
    }
    if (wire->kind == FSM_IO_DIGITAL_OUT) {
        return add_line(&self->out, place);
    }
    return ENOTSUP;
}

int fsm_io_linux_open(fsm_io_linux *self, const fsm_io_linux_places *places)
{
    int error = 0;
    if (self->ioctl == NULL) {
        self->ioctl = ask_system;
    }
    self->period_ns = places->pwm_period_ns;
    self->in.file = self->out.file = -1;
    for (size_t i = 0u; i < self->count && error == 0; i++) {
        error = open_wire(self, (uint16_t)i, places);
        if (error != 0) {
            self->failed = self->wires[i].name;
        }
    }
    if (error == 0) {
        error = open_lines(self, places->gpio);
        if (error != 0) {
            self->failed = "lines";
        }
    }
    if (error != 0) {
        fsm_io_linux_close(self);
    }
    return error;
}

static void note(fsm_io_linux *self, int error, int *first)
{
    if (error == 0) {
        return;
    }
    if (self->errors < UINT32_MAX) {
        self->errors++;
    }
    if (*first == 0) {
        *first = error;
    }
}

int fsm_io_linux_read(fsm_io_linux *self, void *raw)
{
    int first = 0;
    if (self->in.file >= 0) {
        struct gpio_v2_line_values values = {0u, UINT64_MAX >> (64u - self->in.count)};
        if (self->ioctl(self->in.file, GPIO_V2_LINE_GET_VALUES_IOCTL, &values) < 0) {
            note(self, errno, &first);
        } else {
            for (uint16_t i = 0; i < self->in.count; i++) {
                *fsm_io_at(raw, &self->wires[self->in.wires[i]]) = (values.bits >> i & 1u) != 0u;
            }
        }
    }
    for (uint16_t i = 0; i < self->file_count; i++) {
        const fsm_io_wire *const wire = &self->wires[self->files[i].wire];
        if (!fsm_io_is_output(wire)) {
            note(self, read_number(self->files[i].file, fsm_io_at(raw, wire)), &first);
        }
    }
    return first;
}

int fsm_io_linux_write(fsm_io_linux *self, const void *raw)
{
    int first = 0;
    if (self->out.file >= 0) {
        struct gpio_v2_line_values values = {0u, UINT64_MAX >> (64u - self->out.count)};
        for (uint16_t i = 0; i < self->out.count; i++) {
            if (*fsm_io_in(raw, &self->wires[self->out.wires[i]]) != 0) {
                values.bits |= UINT64_C(1) << i;
            }
        }
        if (self->ioctl(self->out.file, GPIO_V2_LINE_SET_VALUES_IOCTL, &values) < 0) {
            note(self, errno, &first);
        }
    }
    for (uint16_t i = 0; i < self->file_count; i++) {
        const fsm_io_wire *const wire = &self->wires[self->files[i].wire];
        if (fsm_io_is_output(wire)) {
            note(self,
                 write_number(self->files[i].file, duty(self, wire, *fsm_io_in(raw, wire))),
                 &first);
        }
    }
    return first;
}

void fsm_io_linux_close(fsm_io_linux *self)
{
    for (uint16_t i = 0; i < self->file_count; i++) {
        (void)close(self->files[i].file);
    }
    if (self->in.file >= 0) {
        (void)close(self->in.file);
    }
    if (self->out.file >= 0) {
        (void)close(self->out.file);
    }
    self->file_count = self->in.count = self->out.count = 0u;
    self->in.file = self->out.file = -1;
}
