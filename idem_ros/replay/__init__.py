"""A recording refined offline."""
