"""The statement of a problem: what a scene holds, its text form, its symmetry, its load steps."""
