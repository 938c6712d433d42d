"""Several clouds at once beside pairs in a chain, in a pose graph, and multiway GICP."""
