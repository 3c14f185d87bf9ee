"""Generated C under hosts that break their contract, with sanitizers and laws that must hold."""
