"""Links between nodes over ZeroMQ (pyzmq), publish and subscribe."""
