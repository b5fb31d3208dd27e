"""Numerical stability: sweeps to extreme values; two independent checks judge each row."""
