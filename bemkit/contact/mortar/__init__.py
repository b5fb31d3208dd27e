"""Mortar coupling of bodies with non-matching meshes by dual multipliers of any degree."""
