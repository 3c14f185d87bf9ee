"""Headers of C, read by libclang: what a binding can name, and a proposal of one."""
