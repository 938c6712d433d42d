"""Bodies in space: poses, grids, voxels, symmetric matrices."""
