"""Several elastic bodies in mutual contact, as one body for the contact solvers."""
