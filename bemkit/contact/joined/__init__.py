"""Several elastic bodies in mutual contact, as one body that contact solvers see."""
