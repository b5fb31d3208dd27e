"""Drivers for contact problems as strategy objects, and the one loop that runs them."""
