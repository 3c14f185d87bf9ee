/* probe.c: counts what a machine executes in the emulator: hooks of unicorn, in C because they run for
 * every instruction and every access to memory.
 *
 * Only the machine counts: instructions outside of the driver while `certify_active` is 1. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum { MOST_RANGES = 16, MOST_RECORDS = 32768, MOST_REDIRECTED = 1024 };

typedef struct {
    uint64_t start, end;
} range;

typedef struct {
    uint32_t instructions, cycles, stack;
} record;

static uint32_t larger(uint32_t a, uint32_t b)
{
    return a < b ? b : a;
}

typedef struct {
    /* set by the owner */
    const volatile uint8_t *active; /* `certify_active` */
    uint64_t active_address;
    range driver;                   /* code of the driver */
    range stack;
    uint32_t limit;        /* instructions of one request */
    uint32_t taken;        /* cycles that a taken branch adds; 0: cycles are not counted */
    uint32_t writable, readable; /* numbers of ranges; all writable ones are readable */
    range write[MOST_RANGES], read[MOST_RANGES];
    const uint8_t *code; /* the memory that holds the code, for counting cycles */
    range coded;
    uint8_t *data; /* the memory that holds the data of the driver */
    range stored;
    uint8_t *reads;    /* `certify_reads` */
    range machine;     /* `fsm_machine` */
    const uint8_t *inputs; /* for each byte of it: 0, or the number of the input in it plus one */
    int (*stop)(void *);
    int (*register_read)(void *, int, void *);
    int (*register_write)(void *, int, const void *);
    int stack_register, pc_register, status_register; /* -1: no status with conditions */
    int argument_registers[3];
    /* set by the hooks */
    uint32_t count; /* records; the last one is being written */
    uint32_t varying; /* the inputs that differ in the combinations of the request, a bit each */
    uint32_t taken_steps; /* those that were executed */
    record now;       /* of the step with this combination */
    uint32_t wrong; /* 0, or what ended the run: 1 read, 2 write, 3 limit */
    uint64_t wrong_address, wrong_pc;
    uint64_t pc, top, next;
    bool was_active; /* the machine has been called, and has not returned */
    uint32_t blocks; /* of the driver, since the last request */
    uint64_t redirected_address; /* the instruction that was not executed */
    uint32_t redirected;
    range redirect[MOST_REDIRECTED]; /* from an address to another one */
    record records[MOST_RECORDS];
} probe;

size_t probe_size(void)
{
    return sizeof(probe);
}

static bool is_in(range of, uint64_t address, uint64_t size)
{
    return address >= of.start && address + size <= of.end;
}

static void stop(void *uc, probe *self, uint32_t why, uint64_t address)
{
    if (self->wrong == 0u) {
        self->wrong = why;
        self->wrong_address = address;
        self->wrong_pc = self->pc;
    }
    (void)self->stop(uc);
}

static uint32_t bits_in(uint32_t mask)
{
    uint32_t count = 0u;
    for (; mask != 0u; mask &= mask - 1u) {
        count++;
    }
    return count;
}

/* Cycles of a Thumb instruction of Armv6-M with memory that never waits, by the tables of instructions
 * in the manuals of Cortex-M0 and Cortex-M0+. `taken`: what a taken branch adds, 2 or 1. */
static uint32_t cycles_of(uint32_t h, uint32_t taken, bool *is_conditional)
{
    const uint32_t moves_pc = 1u + taken;
    *is_conditional = false;
    if (h >> 11 == 0x1Eu || h >> 11 == 0x1Fu || h >> 11 == 0x1Du) {
        return taken == 2u ? 4u : 3u; /* BL, MRS, MSR, barriers */
    }
    if (h >> 10 == 0x11u) { /* ADD, CMP, MOV with high registers; BX, BLX */
        const uint32_t to = (h & 7u) | (h >> 4 & 8u);
        const bool writes = (h >> 8 & 3u) != 1u;
        if ((h >> 8 & 3u) == 3u) {
            return moves_pc;
        }
        return writes && to == 15u ? moves_pc : 1u;
    }
    if (h >> 11 == 9u || (h >> 12 >= 5u && h >> 12 <= 9u)) {
        return 2u; /* LDR, STR in all forms */
    }
    if (h >> 12 == 0xCu) { /* LDM, STM */
        return 1u + bits_in(h & 0xFFu);
    }
    if ((h & 0xFE00u) == 0xB400u) { /* PUSH */
        return 1u + bits_in(h & 0x1FFu);
    }
    if ((h & 0xFE00u) == 0xBC00u) { /* POP */
        const uint32_t popped = bits_in(h & 0x1FFu);
        return (h & 0x100u) == 0u ? 1u + popped : popped + (taken == 2u ? 3u : 2u);
    }
    if (h >> 12 == 0xDu) {
        *is_conditional = true;
        return 1u;
    }
    if (h >> 11 == 0x1Cu) {
        return moves_pc;
    }
    return 1u;
}

/* Called where `certify_request` starts: the next request. */
void probe_request(void *uc, uint64_t address, uint32_t size, void *user)
{
    probe *self = user;
    uint64_t varying = 0u;
    (void)address;
    (void)size;
    (void)self->register_read(uc, self->argument_registers[0], &varying);
    self->varying = (uint32_t)varying;
    if (self->count < MOST_RECORDS) {
        self->records[self->count++] = (record){0u, 0u, 0u};
    }
}

/* Called where `certify_prepare` starts: the step with the next combination of inputs. */
void probe_step(void *uc, uint64_t address, uint32_t size, void *user)
{
    probe *self = user;
    (void)uc;
    (void)address;
    (void)size;
    self->now = (record){0u, 0u, 0u};
    self->taken_steps++;
    self->was_active = false;
    self->blocks = 0u;
}

/* Called where `certify_copy` starts: copies in its place, much faster than emulated instructions. */
void probe_copy(void *uc, uint64_t address, uint32_t size, void *user)
{
    probe *self = user;
    uint64_t given[3] = {0u, 0u, 0u};
    (void)size;
    for (int i = 0; i < 3; i++) {
        (void)self->register_read(uc, self->argument_registers[i], &given[i]);
    }
    given[2] &= 0xFFFFFFFFu;
    if (is_in(self->stored, given[0], given[2]) && is_in(self->stored, given[1], given[2])) {
        (void)memcpy(self->data + (given[0] - self->stored.start),
                     self->data + (given[1] - self->stored.start), given[2]);
    } else {
        stop(uc, self, 2u, address);
    }
}

/* Called for every block of the driver: it does not return if the machine has changed its registers. */
void probe_block(void *uc, uint64_t address, uint32_t size, void *user)
{
    enum { MOST_BLOCKS = 1000000 };
    probe *self = user;
    (void)size;
    if (++self->blocks > MOST_BLOCKS) {
        stop(uc, self, 3u, address);
    }
}

/* Called where a function of a firmware starts that the driver replaces. */
void probe_redirect(void *uc, uint64_t address, uint32_t size, void *user)
{
    probe *self = user;
    (void)size;
    for (uint32_t i = 0u; i < self->redirected; i++) {
        if (self->redirect[i].start == address) {
            self->redirected_address = address;
            (void)self->register_write(uc, self->pc_register, &self->redirect[i].end);
        }
    }
}

/* Called for every instruction outside of the driver. */
void probe_code(void *uc, uint64_t address, uint32_t size, void *user)
{
    probe *self = user;
    record *of;
    (void)size;
    if (*self->active != 1u || self->count == 0u || address == self->redirected_address) {
        self->next = 0u;
        self->redirected_address = 0u;
        return;
    }
    of = &self->records[self->count - 1u];
    if (!self->was_active) {
        self->was_active = true;
        self->top = 0u;
        (void)self->register_read(uc, self->stack_register, &self->top);
    }
    self->pc = address;
    of->instructions = larger(of->instructions, ++self->now.instructions);
    if (self->now.instructions > self->limit) {
        stop(uc, self, 3u, address);
        return;
    }
    if (self->taken != 0u) {
        bool is_conditional = false;
        if (self->next != 0u && address != self->next) {
            self->now.cycles += self->taken;
        }
        self->next = 0u;
        if (is_in(self->coded, address, 2u)) {
            const uint8_t *at = self->code + (address - self->coded.start);
            self->now.cycles += cycles_of((uint32_t)(at[0] | (uint32_t)at[1] << 8), self->taken, &is_conditional);
            self->next = is_conditional ? address + 2u : 0u;
        }
        of->cycles = larger(of->cycles, self->now.cycles);
    }
}

/* Note whether an access reads or writes inputs that differ in the combinations of the request. */
static void note_inputs(probe *self, uint64_t address, uint64_t bytes)
{
    for (uint64_t i = 0u; i < bytes; i++) {
        if (is_in(self->machine, address + i, 1u)) {
            const uint8_t input = self->inputs[address + i - self->machine.start];
            if (input != 0u && (self->varying >> (input - 1u) & 1u) != 0u) {
                *self->reads = 1u;
            }
        }
    }
}

static bool is_by_driver(void *uc, const probe *self)
{
    uint64_t pc = 0u;
    (void)self->register_read(uc, self->pc_register, &pc);
    return is_in(self->driver, pc, 1u);
}

/* Clears the conditions of an IT block. The emulator (unicorn 2.1) sets them where an instruction of a
 * block accesses memory with a hook, and would apply them to the next instructions after the block. */
static void leave_block(void *uc, const probe *self)
{
    const uint32_t conditions = 0x0600FC00u;
    uint32_t status = 0u;
    (void)self->register_read(uc, self->status_register, &status);
    if ((status & conditions) != 0u) {
        status &= ~conditions;
        (void)self->register_write(uc, self->status_register, &status);
    }
}

/* Called for every access to memory. */
void probe_memory(void *uc, int type, uint64_t address, int size, int64_t value, void *user)
{
    enum { FRAME = 64, UC_MEM_WRITE = 17 };
    probe *self = user;
    record *of;
    const bool writes = type == UC_MEM_WRITE;
    const uint64_t bytes = (uint64_t)(unsigned)size;
    if (self->status_register >= 0) {
        leave_block(uc, self);
    }
    if (*self->active != 0u && self->varying != 0u && *self->reads == 0u) {
        note_inputs(self, address, bytes); /* a function of the host may read them by a pointer */
    }
    if (*self->active != 1u) {
        return;
    }
    if (address == self->active_address) {
        self->was_active = self->was_active && !(writes && (value & 0xFF) == 0);
        return;
    }
    if (!self->was_active) {
        return;
    }
    of = &self->records[self->count - 1u];
    if (is_in(self->stack, address, bytes) && address < self->top + FRAME) {
        if (writes && address < self->top && self->top - address > of->stack && !is_by_driver(uc, self)) {
            of->stack = (uint32_t)(self->top - address);
        }
        return;
    }
    for (uint32_t i = 0u; i < self->writable; i++) {
        if (is_in(self->write[i], address, bytes)) {
            return;
        }
    }
    for (uint32_t i = 0u; !writes && i < self->readable; i++) {
        if (is_in(self->read[i], address, bytes)) {
            return;
        }
    }
    if (!is_by_driver(uc, self)) {
        stop(uc, self, writes ? 2u : 1u, address);
    }
}
