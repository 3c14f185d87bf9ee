"""Generated C under a script: the source of a program around a machine, and how it is run."""
