"""Dense and iterative linear algebra: factorisations that name singularity, block conjugate gradients, threads."""
