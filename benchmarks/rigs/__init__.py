"""Rigs of several LiDARs: calibrated from far starts, simulated and real."""
