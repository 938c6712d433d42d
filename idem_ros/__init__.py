"""Online fine registration of point clouds by Iterative Differential Entropy Minimization."""
