"""Displacements and stresses inside a body by Somigliana's identity."""
