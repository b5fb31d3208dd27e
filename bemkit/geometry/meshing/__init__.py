"""From outlines to meshes: division into elements, refinement, gradual lengths, order of nodes."""
