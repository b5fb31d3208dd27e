"""Solvers of contact problems as strategy objects, and the loop that runs them."""
