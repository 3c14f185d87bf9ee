"""Properties with search procedures of their own: temporal ones in dense time, and refinement."""
