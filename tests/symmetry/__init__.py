"""Symmetry lines by images."""
