"""The form for size: states and transitions share code and differ in tables."""
