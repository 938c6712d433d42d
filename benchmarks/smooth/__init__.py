"""A trajectory made consistent, its time and memory, and the score of its map."""
