"""Contact with friction: obstacles, laws, projections, the problem that a body poses, and its certificate."""
