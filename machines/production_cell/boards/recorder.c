#include "recorder.h"

#include "fsm_trace.h"

#include <stdio.h>
#include <string.h>

enum { HEAD = 3, MACHINES = 16, LONGEST = 128 };

static struct {
    FILE *file;
    uint8_t bytes[HEAD + LONGEST]; /* a run that may turn out to be idle */
    size_t length;
    bool has_failed;
    bool is_body; /* the next call brings the rest of a record */
    bool was_posted[MACHINES]; /* since the last run that was kept */
} recorder;

bool recorder_open(const char *path)
{
    recorder.file = fopen(path, "wb");
    return recorder.file != NULL;
}

bool recorder_close(void)
{
    bool is_complete = !recorder.has_failed;
    if (recorder.file != NULL && fclose(recorder.file) != 0)
        is_complete = false;
    recorder.file = NULL;
    return is_complete;
}

void recorder_flush(void)
{
    if (recorder.file != NULL && fflush(recorder.file) != 0)
        recorder.has_failed = true;
}

static void keep(const uint8_t *bytes, size_t size)
{
    if (fwrite(bytes, 1, size, recorder.file) != size)
        recorder.has_failed = true;
}

static void keep_pending(void)
{
    if (recorder.length > HEAD)
        recorder.was_posted[recorder.bytes[HEAD] % MACHINES] = false;
    keep(recorder.bytes, recorder.length);
    recorder.length = 0u;
}

/* A run that took no transition and found no event left the machine as it was: it need not be done
 * again, and there is one in each millisecond. */
static bool is_idle(void)
{
    return recorder.length > HEAD && !recorder.was_posted[recorder.bytes[HEAD] % MACHINES];
}

static void begin_record(const uint8_t *head)
{
    const bool ends_a_run = head[0] == FSM_LOG_END && recorder.length > 0u;
    recorder.is_body = head[1] != 0u || head[2] != 0u;
    if (ends_a_run && is_idle()) {
        recorder.length = 0u;
        return;
    }
    if (recorder.length > 0u)
        keep_pending();
    if (head[0] == FSM_LOG_RUN && head[2] == 0u && head[1] <= LONGEST) {
        memcpy(recorder.bytes, head, HEAD);
        recorder.length = HEAD;
    } else {
        keep(head, HEAD);
    }
}

static uint8_t kind; /* of the record at hand */

void fsm_log_write(const uint8_t *bytes, size_t size)
{
    if (recorder.file == NULL)
        return;
    if (!recorder.is_body) {
        kind = bytes[0];
        begin_record(bytes);
        return;
    }
    recorder.is_body = false;
    if (kind == FSM_LOG_POST && size > 0u)
        recorder.was_posted[bytes[0] % MACHINES] = true;
    if (recorder.length == HEAD) {
        memcpy(recorder.bytes + HEAD, bytes, size);
        recorder.length += size;
    } else {
        keep(bytes, size);
    }
}
