"""Common parts of verbs: options, output, atomic writing of files, interrupts."""
