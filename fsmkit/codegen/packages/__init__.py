"""Generated C as a package of an embedded build: a library, its manifest, one example."""
