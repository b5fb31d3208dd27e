"""The exit codes of commands; 0 says solved, or done."""

NOT_CONVERGED = 1
"""Solved, but not converged; or a method that ends without a result."""
BAD_INPUT = 2
"""One line on standard error says what is wrong."""
INACCURATE = 3
"""Certified, but less accurate than asked for."""
INTERRUPTED, PIPE_CLOSED, TERMINATED = 130, 141, 143
