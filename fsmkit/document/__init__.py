"""Documents: names and unread text in, each with its place; statements and declarations out.

One Document for each file, the same for all notations. Nothing is resolved yet: no type, no target.
"""
