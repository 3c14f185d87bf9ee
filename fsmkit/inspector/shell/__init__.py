"""`fsmkit run` on a terminal: a face of the hub that takes a line and prints what happened.

`shell` obeys lines, `completion` says how one may go on, `outline` shows what is active; `prompt`
alone is about terminals.
"""
