"""A boundary operator compressed over a tree of clusters, and the direct solver that this gives."""
