/* driver.c: answers requests to a machine, whatever machine it is; see driver.h. */
#include "driver.h"

uint8_t certify_requests[CERTIFY_REQUEST_BYTES];
uint8_t certify_answers[CERTIFY_ANSWER_BYTES] CERTIFY_ALIGNED;
uint32_t certify_request_size;
uint32_t certify_answered;
uint32_t certify_answer_size;
volatile uint8_t certify_active;
volatile uint8_t certify_reads;
uint8_t certify_manner;

static uint32_t at;
static uint32_t trace_size;
static uint32_t trace_most;

uint8_t certify_leave(void)
{
    const uint8_t active = certify_active;
    certify_active = (uint8_t)(active != 0u ? 2u : 0u);
    return active;
}

uint32_t certify_enter(uint8_t active)
{
    certify_active = active;
    return 0x5A5A5A5Au;
}

uint8_t certify_take8(void)
{
    return certify_requests[at++];
}

uint16_t certify_take16(void)
{
    const uint16_t low = certify_take8();
    return (uint16_t)(low | (uint16_t)((uint32_t)certify_take8() << 8));
}

uint32_t certify_take32(void)
{
    const uint32_t low = certify_take16();
    return low | (uint32_t)certify_take16() << 16;
}

uint64_t certify_take64(void)
{
    const uint64_t low = certify_take32();
    return low | (uint64_t)certify_take32() << 32;
}

float certify_take_float(void)
{
    union {
        uint32_t bits;
        float value;
    } both;
    both.bits = certify_take32();
    return both.value;
}

double certify_take_double(void)
{
    union {
        uint64_t bits;
        double value;
    } both;
    both.bits = certify_take64();
    return both.value;
}

void certify_put8(uint8_t value)
{
    if (trace_size < trace_most) {
        certify_answers[certify_answer_size++] = value;
    }
    trace_size++;
}

void certify_put16(uint16_t value)
{
    certify_put8((uint8_t)(value & 0xFFu));
    certify_put8((uint8_t)(value >> 8));
}

void certify_put32(uint32_t value)
{
    certify_put16((uint16_t)(value & 0xFFFFu));
    certify_put16((uint16_t)(value >> 16));
}

void certify_put64(uint64_t value)
{
    certify_put32((uint32_t)(value & 0xFFFFFFFFu));
    certify_put32((uint32_t)(value >> 32));
}

/* All NaN are one value: processors have several. */
void certify_put_float(float value)
{
    union {
        uint32_t bits;
        float value;
    } both;
    both.value = value;
    certify_put32(value != value ? 0x7FC00000u : both.bits);
}

void certify_put_double(double value)
{
    union {
        uint64_t bits;
        double value;
    } both;
    both.value = value;
    certify_put64(value != value ? UINT64_C(0x7FF8000000000000) : both.bits);
}

#ifdef CERTIFY_HOST
void certify_copy(void *to, const void *from, uint32_t size)
{
    uint32_t *target = to;
    const uint32_t *source = from;
    uint32_t i = 0u;
    for (; i < size / 4u; i++) {
        target[i] = source[i];
    }
    for (i *= 4u; i < size; i++) {
        ((uint8_t *)to)[i] = ((const uint8_t *)from)[i];
    }
}
#else
/* A hook of the emulator copies: see probe_copy. */
__attribute__((noinline)) void certify_copy(void *to, const void *from, uint32_t size)
{
    __asm__ volatile("" : : "r"(to), "r"(from), "r"(size) : "memory");
}
#endif

static void store32(uint32_t place, uint32_t value)
{
    for (uint32_t i = 0u; i < 4u; i++) {
        certify_answers[place + i] = (uint8_t)(value >> (8u * i) & 0xFFu);
    }
}

#ifdef CERTIFY_HOST
extern uint8_t certify_saved[];
extern uint32_t certify_saved_size;

static void certify_request(uint32_t varying)
{
    (void)varying;
    certify_reads = 1u;
}
#else
/* A hook of the emulator is here: see probe_request. */
static __attribute__((noinline)) void certify_request(uint32_t varying)
{
    certify_reads = 0u;
    __asm__ volatile("" : : "r"(varying) : "memory");
}
#endif

static bool is_equal(const uint8_t *one, const uint8_t *other, uint32_t size)
{
    uint32_t i = 0u;
    while (i < size && one[i] == other[i]) {
        i++;
    }
    return i == size;
}

/* Take the step with the inputs at a place; `rest`: the place after all inputs. */
static void take_step(uint8_t action, uint32_t now, uint32_t inputs, uint32_t rest)
{
    const uint32_t start = certify_answer_size;
    uint32_t returned;
    certify_answer_size += 8u;
    trace_size = 0u;
    trace_most = CERTIFY_TRACE_BYTES;
    at = rest;
    returned = certify_perform(action, now);
    at = inputs;
    if (!certify_restore_inputs()) {
        returned |= CERTIFY_INPUTS_CHANGED;
    }
    store32(start, trace_size);
    store32(start + 4u, returned);
    while (certify_answer_size % 4u != 0u) {
        certify_answers[certify_answer_size++] = 0u;
    }
    certify_copy(certify_answers + certify_answer_size, certify_machine(), certify_machine_size);
    for (certify_answer_size += certify_machine_size; certify_answer_size % 4u != 0u; certify_answer_size++) {
        certify_answers[certify_answer_size] = 0u;
    }
    certify_after(action == CERTIFY_REBASE ? 0u : now);
}

/* An answer: bytes of the trace (4), what the functions returned (4), the trace, the machine. */
void certify_main(void)
{
    at = certify_answered;
    certify_answer_size = 0u;
    while (at < certify_request_size
           && certify_answer_size + 2u * (CERTIFY_TRACE_BYTES + certify_machine_size + 16u) <= CERTIFY_ANSWER_BYTES) {
        const uint32_t first = certify_answer_size;
        uint32_t end, now, varying, inputs, size, next;
        uint16_t count;
        uint8_t action;
#ifdef CERTIFY_HOST
        const uint32_t first_saved = certify_saved_size;
        uint32_t next_saved;
#endif
        end = certify_take16();
        end += at;
        action = certify_take8();
        now = certify_take32();
        certify_manner = certify_take8();
        count = certify_take16();
        varying = certify_take32();
        certify_request(varying);
        inputs = at;
        certify_prepare();
        size = at - inputs;
        take_step(action, now, inputs, inputs + count * size);
        next = certify_answer_size;
#ifdef CERTIFY_HOST
        next_saved = certify_saved_size;
#endif
        for (uint16_t i = 1u; i < count && certify_reads != 0u; i++) {
            bool same;
            at = inputs + i * size;
            certify_prepare();
            take_step(action, now, inputs + i * size, inputs + count * size);
            same = certify_answer_size - next == next - first
                   && is_equal(certify_answers + first, certify_answers + next, next - first);
#ifdef CERTIFY_HOST
            same = same && is_equal(certify_saved + first_saved, certify_saved + next_saved, next_saved - first_saved);
            certify_saved_size = next_saved;
#endif
            certify_answer_size = next;
            if (!same) {
                certify_answers[first + 7u] |= (uint8_t)(CERTIFY_INPUTS_MATTER >> 24);
                break;
            }
        }
        at = end;
        certify_answered = at;
    }
}
