"""ZeroMQ: links between nodes by publish and subscribe, with CURVE keys; pyzmq, in C libzmq."""
