"""The features of the server, one file each: pure functions of the index and a position."""
