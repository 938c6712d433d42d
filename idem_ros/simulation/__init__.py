"""A LiDAR simulator with exact truth: scenes, ray casting, drives, maps and demo recordings."""
