"""From a scene and its mesh to the contact problem, and back to physical fields."""
