"""Tools that look for faults: random scenes and their judgement."""
