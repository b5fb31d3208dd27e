"""Contact with friction: obstacles, laws, projections, the contact problem of a body, and its certificate."""
