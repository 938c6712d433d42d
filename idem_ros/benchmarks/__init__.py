"""Measurements of accuracy and time, side by side with the methods of small_gicp."""
