"""Sweeps: one scene under many values of some of its numbers."""
