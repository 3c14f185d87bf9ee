"""The flat form: expressions only, for tools without functions."""
