"""What verbs share: their options, what they print with, files written whole, interrupts."""
