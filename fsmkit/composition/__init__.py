"""The machines of a system joined in one program: what their direct connections are in C."""
