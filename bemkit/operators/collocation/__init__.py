"""Collocation at the middles of constant elements: points, columns, reconstructed gradients, reciprocity."""
