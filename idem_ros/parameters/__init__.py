"""Parameters: described once, read from anywhere."""
