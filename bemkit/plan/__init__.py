"""Only what the scene needs: the cost of a scene, what is skipped, and why."""
