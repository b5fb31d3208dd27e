"""Positions of bodies and points relative to one another."""
