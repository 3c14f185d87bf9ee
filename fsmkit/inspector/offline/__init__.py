"""The hub in JavaScript, with which a page simulates offline. `bundle` joins its files."""
