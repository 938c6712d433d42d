"""`python -m benchmarks sweeps`: sensors that move while they scan."""
