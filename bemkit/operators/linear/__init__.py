"""Dense and iterative linear algebra: factorisations that name singularity, GMRES, threads."""
