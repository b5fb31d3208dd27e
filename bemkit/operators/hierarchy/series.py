"""The series of element fields far from the element; see `element_fields`."""

FAR = 10.0
"""Half lengths of the element from which on the series is taken."""
SERIES = tuple(1.0 / (2 * k + 1) for k in range(9, 0, -1))
"""Its factors, the last one first: what follows is below 10^-20."""
