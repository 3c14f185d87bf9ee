"""Charts in editors: the language server, and the index of names that it answers from.

Text is the source: nothing that a file names is imported or run, and what does not parse is
answered from the last text that did.
"""
