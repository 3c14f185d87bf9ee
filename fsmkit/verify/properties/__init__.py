"""Properties that are decided by searches of their own: temporal in dense time, refinement."""
