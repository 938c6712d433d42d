"""What messages of ROS hold, as arrays: for rclpy and rosbags alike."""
