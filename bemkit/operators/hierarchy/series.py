"""The series of element fields far from the element; see `element_fields`."""

FAR = 16.0
"""Half lengths of the element from which on the series is taken."""
_ORDERS = range(7, 0, -1)
SERIES = tuple(1.0 / (2 * k + 1) for k in _ORDERS)
"""Its factors, the last one first: what follows is below 10^-20."""
REST = tuple(2.0 * k / (2 * k + 1) for k in _ORDERS)
"""By which a geometric series exceeds it, of moments."""
