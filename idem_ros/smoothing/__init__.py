"""A trajectory made consistent: scans of a whole recording joined, window by window, then all."""
