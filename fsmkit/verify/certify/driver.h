/* driver.h: steps of one generated machine by requests, on this computer and in the emulator.
 *
 * A request: its bytes after these (2), the action (1), the time (4), the manner (1), how many combinations of inputs
 * follow (2), which inputs differ in them (4, a bit each; the last one for all further ones), the
 * combinations, what the manner needs, the event, the results of operations. The machine takes the step with each combination;
 * all must lead to the same. The answer holds what the host of the machine notices, and then every byte
 * of the machine with its former inputs; zeros fill each up to a multiple of 4. Numbers are least significant byte first, so requests are the same for all processors.
 *
 * driver_X.c, which is generated for a machine X, defines the functions at the end. */
#ifndef CERTIFY_DRIVER_H
#define CERTIFY_DRIVER_H

#include "fsm.h"

enum { CERTIFY_START, CERTIFY_DISPATCH, CERTIFY_POST, CERTIFY_RUN, CERTIFY_OBSERVE, CERTIFY_REBASE,
       CERTIFY_STEP_EVENTLESS, CERTIFY_STEP_EVENT, CERTIFY_STEP_TIMER };
enum { CERTIFY_CALLED = 1, CERTIFY_SENT = 2 };
#define CERTIFY_INPUTS_CHANGED 0x40000000u /* flags in the returned value */
#define CERTIFY_INPUTS_MATTER 0x80000000u  /* a combination of inputs led to something else */

/* What the host does whenever the machine calls it: look at the machine, post events, call the functions
 * that a step excludes. With full counters the machine has counted almost as much as it can. */
enum { CERTIFY_LOOKING = 1, CERTIFY_POSTING = 2, CERTIFY_NESTING = 4, CERTIFY_FULL = 8 };

#ifndef CERTIFY_REQUEST_BYTES
#define CERTIFY_REQUEST_BYTES 0x40000u
#define CERTIFY_ANSWER_BYTES 0x100000u
#define CERTIFY_TRACE_BYTES 0x4000u /* at most, of one answer; the rest only counts */
#endif

extern uint8_t certify_requests[CERTIFY_REQUEST_BYTES];
extern uint8_t certify_answers[CERTIFY_ANSWER_BYTES];
extern uint32_t certify_request_size; /* bytes of all requests */
extern uint32_t certify_answered;     /* bytes of the requests that have been answered */
extern uint32_t certify_answer_size;
extern uint8_t certify_manner; /* of the current request */

/* 1 while the machine's own code runs: what happens then is counted. 2: it has called its host. */
extern volatile uint8_t certify_active;
/* Whether the machine has accessed one of the inputs that differ: if not, all combinations are one step.
 * Only a hook of the emulator knows. */
extern volatile uint8_t certify_reads;
extern uint8_t certify_leave(void); /* for functions of the host: nothing counts until `certify_enter` */
/* Its result stays in the register of results: a machine must not take it for one of its own. */
extern uint32_t certify_enter(uint8_t active);

/* Like `CERTIFY`, but nothing counts while the machine waits for its host. */
#define CERTIFY_LOOK(call)                                                                         \
    do {                                                                                           \
        const uint8_t active_ = certify_active;                                                    \
        certify_active = (uint8_t)(active_ != 0u ? 2u : 1u);                                       \
        call;                                                                                      \
        certify_active = active_;                                                                  \
    } while (0)

#define CERTIFY_ALIGNED __attribute__((aligned(8)))

#define CERTIFY(call)                                                                              \
    do {                                                                                           \
        certify_active = 1u;                                                                       \
        call;                                                                                      \
        certify_active = 0u;                                                                       \
    } while (0)

/* Answer requests from where the last call ended, as many as fit. */
void certify_main(void);

uint8_t certify_take8(void);
uint16_t certify_take16(void);
uint32_t certify_take32(void);
uint64_t certify_take64(void);
float certify_take_float(void);
double certify_take_double(void);
void certify_put8(uint8_t value);
void certify_put16(uint16_t value);
void certify_put32(uint32_t value);
void certify_put64(uint64_t value);
void certify_put_float(float value);
void certify_put_double(double value);
void certify_copy(void *to, const void *from, uint32_t size); /* both lie at multiples of 4 */

/* ---- in driver_X.c ---- */

extern const uint32_t certify_machine_size;
void *certify_state(void);   /* from which all requests start */
void *certify_machine(void); /* the one that a request changes */
void certify_prepare(void);  /* copies the state, takes the inputs and what the manner needs */
bool certify_restore_inputs(void); /* takes the same inputs; whether the machine has kept them */
uint32_t certify_perform(uint8_t action, uint32_t now); /* returns what the functions returned */
void certify_after(uint32_t now);                       /* on this computer only: saves the machine */

#endif
