"""The independent check of solutions."""
