"""A scan in maps of 0.2 to 50 million points: its cost, its error, its verdict."""
