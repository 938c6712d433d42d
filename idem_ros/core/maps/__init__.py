"""A map as the target: what of it a scan can reach, prepared when it is first reached."""
