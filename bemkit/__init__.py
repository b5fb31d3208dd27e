"""Frictional contact of elastic bodies by boundary elements."""

__version__ = "0.1.0"
