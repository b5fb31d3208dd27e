"""Lines of symmetry, the images of elements, and functions on these images."""
