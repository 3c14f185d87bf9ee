"""The hub in JavaScript: a page simulates by itself with it. `bundle` makes one file of all."""
