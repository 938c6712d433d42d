"""Recordings, read and written: the only room that imports rosbags and mcap."""
