/* recorder.h: the log of all machines of the board, in one file that `fsmkit run CHART --replay FILE`
 * performs again in the interpreter, machine by machine. */
#ifndef RECORDER_H
#define RECORDER_H

#include <stdbool.h>

/* Begin a file; false if it cannot be written. Before, nothing is recorded. */
bool recorder_open(const char *path);

/* End it; false if not all could be written. */
bool recorder_close(void);

#endif
