"""C headers, read by libclang: the names for a binding, and a proposal of one."""
