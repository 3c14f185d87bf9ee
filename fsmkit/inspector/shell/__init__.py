"""The shell of `fsmkit run`: a client of the hub that reads lines and prints steps.

`shell` executes lines, `completion` completes them, `outline` prints the active states. Only
`prompt` depends on terminals.
"""
