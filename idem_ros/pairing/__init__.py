"""Which target, source and guess belong together."""
