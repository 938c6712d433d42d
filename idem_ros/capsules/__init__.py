"""One source that went wrong, kept as it was: a small recording that says its own result."""
