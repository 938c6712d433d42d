"""The nodes and the player: the only room that imports rclpy."""
