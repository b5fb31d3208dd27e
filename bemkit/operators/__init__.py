"""Boundary operators of plane elasticity, exact to round-off, and the elastic maps that are made from them."""
