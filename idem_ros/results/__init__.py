"""Results in files: written, read, summed up, compared, gated."""
