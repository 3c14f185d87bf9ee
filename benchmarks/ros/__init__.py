"""Round trips between two nodes in C by topics of Cyclone DDS."""
