"""The protocol `fsmkit.live`: macrosteps in, messages in JSON out, and commands back.

A macrostep is told in the words of its trace (`runtime.interpreter.trace`), so whatever says how it
went is held by the differential test, too.
"""
