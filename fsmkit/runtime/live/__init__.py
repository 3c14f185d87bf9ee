"""The protocol `fsmkit.live`: macrosteps as JSON messages, and commands in return.

Messages use the words of the trace (`runtime.interpreter.trace`), so the differential test covers
them, too.
"""
