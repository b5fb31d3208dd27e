"""Estimated errors of random scenes over their true errors, by degree."""
