"""Several elastic bodies made ready to solve."""
