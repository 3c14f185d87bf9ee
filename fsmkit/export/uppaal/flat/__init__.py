"""The flat form: expressions only, for tools that know no functions."""
