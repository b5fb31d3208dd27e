"""Convergence to closed forms: observed orders and error ceilings."""
