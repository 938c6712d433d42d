"""Online fine registration of point clouds by Iterative Differential Entropy Minimization."""

__version__ = '0.1.0'
