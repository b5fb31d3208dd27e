"""Tools of the repository that look for faults in bemkit; they are not part of the package."""
