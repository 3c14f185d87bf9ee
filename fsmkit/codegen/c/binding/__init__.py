"""A machine that is bound to the host's own C: its part of the header, and a source beside it."""
