"""Documents: the content of one file, as names and unread texts with locations.

All notations share the class. Nothing is resolved yet: no type, no target.
"""
