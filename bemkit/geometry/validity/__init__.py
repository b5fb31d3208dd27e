"""What makes an outline or mesh impossible: self-intersection, nested loops, extreme magnitudes."""
