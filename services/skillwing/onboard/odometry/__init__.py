"""LiDAR-inertial odometry: the drone's pose from scans and inertial measurements alone."""
