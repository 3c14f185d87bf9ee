/* recorder.h: the log of all machines of the board, in one file that `fsmkit run CHART --replay FILE`
 * performs again in the interpreter, machine by machine. */
#ifndef RECORDER_H
#define RECORDER_H

#include <stdbool.h>

/* Begin a file; false if it cannot be written. Before, nothing is recorded. */
bool recorder_open(const char *path);

/* Write out what is recorded so far, for who reads the file meanwhile. */
void recorder_flush(void);

/* End it; false if not all could be written. */
bool recorder_close(void);

#endif
