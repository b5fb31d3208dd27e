"""Integrals of the kernels over pairs of elements: near, far and the same element, straight and curved."""
