"""Scenes that hold a motion weakly or not at all, seen by patterns that pretend they do."""
