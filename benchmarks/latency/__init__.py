"""Round trips between two nodes in real time, and the jitter of their loops beside cyclictest's."""
