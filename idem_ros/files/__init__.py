"""Files of clouds and of poses, in the layouts that scanners, drivers and libraries write."""
