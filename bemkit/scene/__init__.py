"""Problems: scenes, their files, their symmetry, their load steps."""
