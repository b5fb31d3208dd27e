"""Curves of any form: parametrised by their arc length, rational B-splines, and shapes drawn with them."""
