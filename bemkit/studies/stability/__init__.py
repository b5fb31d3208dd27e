"""Numerical stability: sweeps to the extremes, each row judged by two independent pieces of evidence."""
