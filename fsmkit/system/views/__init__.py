"""Views of systems: drawings and trees."""
