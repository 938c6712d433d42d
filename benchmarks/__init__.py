"""Measurements of accuracy and time, side by side with the methods of small_gicp."""

from pathlib import Path

CHECKOUT = Path(__file__).resolve().parent.parent
