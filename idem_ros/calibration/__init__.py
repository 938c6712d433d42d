"""The extrinsics of several LiDARs on one rig: from instants at which they all saw a scene."""
