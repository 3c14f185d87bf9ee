/* recorder.h: the effects of a machine's local step, recorded by the operations, ports and hooks of
 * the adapter, and the choices made for it. There is one recorder: a step is run, read, and cleared
 * before the next. */
#ifndef FSM_RECORDER_H
#define FSM_RECORDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef int64_t fsm_value; /* floats travel as their bits */

struct fsm_machine;

enum {
    FSM_MOST_VALUES = 32,   /* values of one message */
    FSM_MOST_SENT = 256,    /* messages of one local step */
    FSM_MOST_CHOICES = 256, /* choices of one local step */
    FSM_MOST_NOTES = 256,   /* marks of one local step */
    FSM_OBSERVED = 1 << 16  /* the port at which monitors watch the first event of a machine */
};

typedef struct {
    uint32_t port, count;
    fsm_value values[FSM_MOST_VALUES];
} fsm_sent_message;

typedef struct {
    fsm_sent_message sent[FSM_MOST_SENT];
    uint32_t sent_count;
    uint32_t notes[FSM_MOST_NOTES]; /* what is noted of a step: marks of the machine, counted from its first */
    uint32_t note_count;
    uint32_t chosen[FSM_MOST_CHOICES], limits[FSM_MOST_CHOICES];
    uint32_t free_of[FSM_MOST_CHOICES]; /* by choice: the free input it was made for; UINT32_MAX: another thing */
    uint32_t choice_count, choice_at;
    bool read[FSM_MOST_CHOICES]; /* by free input: chosen in this run, since it was read */
    bool again;              /* a step is taken again: its choices are those of all free inputs, then all others */
    void *state;             /* of the current machine, where its inputs are chosen */
    bool took;               /* a transition was taken */
    uint32_t budget;         /* the fewest microsteps that were left */
    const struct fsm_machine *machine; /* current */
    unsigned char *states_seen, *transitions_seen; /* of that; coverage of the whole run */
    const char *too_much;    /* a bound above was passed */
    bool tracing;            /* print what happens */
    void (*begin)(void *m);  /* of the machine that starts: puts its shared data back; may be NULL */
} fsm_recorder;

extern fsm_recorder fsm_recording;

/* Marks of a machine: these two, then one for each event that was not answered, and one for each that was taken.
 * Where a suite of tests is made, also one for each transition that was taken and each state that was entered. */
enum { FSM_NOTE_FULL, FSM_NOTE_FAULT, FSM_NOTE_UNHANDLED };

void fsm_recorder_start(void);   /* before a step; the choices stay */
bool fsm_recorder_advance(void); /* to the next sequence of choices; false after the last */
void fsm_recorder_forget(void);  /* the choices */

/* The choices of a run as it can be taken again: a value for each free input, the first one for those that were not
 * read, then all others in the order in which they were made. Returns how many; more than FSM_MOST_CHOICES: too many. */
uint32_t fsm_recorder_choices(uint32_t free_count, uint32_t *choices);

/* Functions for the adapter and the hooks. */
uint32_t fsm_choose(uint32_t n); /* a value below n, each in turn */
uint32_t fsm_choose_for(uint32_t n, uint32_t free);
void fsm_note_sent(uint32_t port, uint32_t count, const fsm_value *values);
void fsm_note_mark(uint32_t note);
void fsm_note_text(uint32_t note, const char *what, const char *text);
void fsm_note_budget(uint32_t left);
void fsm_note_line(const char *what, uint32_t number);

#endif
