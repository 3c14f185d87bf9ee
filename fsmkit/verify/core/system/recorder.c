#include "system/recorder.h"

#include <inttypes.h>
#include <stdio.h>

fsm_recorder fsm_recording;

void fsm_recorder_start(void)
{
    fsm_recorder *self = &fsm_recording;
    self->sent_count = self->note_count = self->choice_at = 0;
    self->budget = UINT32_MAX;
    self->took = false;
}

void fsm_recorder_forget(void)
{
    fsm_recording.choice_count = 0;
}

/* An odometer: the last choice goes on; where it is through, the one before it. */
bool fsm_recorder_advance(void)
{
    fsm_recorder *self = &fsm_recording;
    while (self->choice_count > 0) {
        uint32_t last = self->choice_count - 1;
        if (++self->chosen[last] < self->limits[last])
            return true;
        self->choice_count = last;
    }
    return false;
}

uint32_t fsm_choose(uint32_t n)
{
    return fsm_choose_for(n, UINT32_MAX);
}

uint32_t fsm_choose_for(uint32_t n, uint32_t free)
{
    fsm_recorder *self = &fsm_recording;
    if (n < 2)
        return 0;
    if (self->choice_at == FSM_MOST_CHOICES) {
        self->too_much = "too many choices in one step";
        return 0;
    }
    uint32_t at = self->choice_at++;
    if (at == self->choice_count) {
        self->chosen[at] = 0;
        self->choice_count++;
    }
    self->limits[at] = n;
    self->free_of[at] = free;
    return self->chosen[at] < n ? self->chosen[at] : 0;
}

uint32_t fsm_recorder_choices(uint32_t free_count, uint32_t *choices)
{
    const fsm_recorder *self = &fsm_recording;
    uint32_t count = free_count;
    for (uint32_t i = 0; i < free_count && i < FSM_MOST_CHOICES; i++)
        choices[i] = 0;
    for (uint32_t at = 0; at < self->choice_at; at++) {
        if (self->free_of[at] < free_count)
            choices[self->free_of[at]] = self->chosen[at];
        else if (count++ < FSM_MOST_CHOICES)
            choices[count - 1] = self->chosen[at];
    }
    return count;
}

void fsm_note_sent(uint32_t port, uint32_t count, const fsm_value *values)
{
    fsm_recorder *self = &fsm_recording;
    if (self->sent_count == FSM_MOST_SENT || count > FSM_MOST_VALUES) {
        self->too_much = "too many messages in one step";
        return;
    }
    fsm_sent_message *sent = &self->sent[self->sent_count++];
    *sent = (fsm_sent_message){.port = port, .count = count};
    for (uint32_t i = 0; i < count; i++)
        sent->values[i] = values[i];
}

void fsm_note_mark(uint32_t note)
{
    fsm_recorder *self = &fsm_recording;
    for (uint32_t i = 0; i < self->note_count; i++)
        if (self->notes[i] == note)
            return;
    if (self->note_count == FSM_MOST_NOTES)
        self->too_much = "too much to note in one step";
    else
        self->notes[self->note_count++] = note;
}

void fsm_note_text(uint32_t note, const char *what, const char *text)
{
    fsm_note_mark(note);
    if (fsm_recording.tracing)
        printf("%s %s\n", what, text);
}

void fsm_note_budget(uint32_t left)
{
    if (left < fsm_recording.budget)
        fsm_recording.budget = left;
}

void fsm_note_line(const char *what, uint32_t number)
{
    if (fsm_recording.tracing)
        printf("%s %" PRIu32 "\n", what, number);
}
