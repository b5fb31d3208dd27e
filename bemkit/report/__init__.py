"""Results as pages: reports in one file, and what notebooks show."""
