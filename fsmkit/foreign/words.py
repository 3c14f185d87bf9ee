"""Words that no name of an imported chart may be."""

RESERVED = frozenset(
    {"log", "send", "raise", "cancel", "reply", "return", "super", "if", "else", "for", "in", "min"}
    | {"max", "abs", "len", "In", "event", "and", "or", "not", "true", "false", "True", "False"}
    | {"is", "null", "undefined", "assign", "script", "to", "after", "as", "let", "var", "int"}
    | {"bool", "ms", "new", "typeof", "void", "instanceof", "const", "float", "with", "elif"}
)
"""Reserved words of the action language, and of the notations that it is written in."""
