"""Mortar coupling of bodies whose meshes do not match, with dual multipliers of every degree."""
