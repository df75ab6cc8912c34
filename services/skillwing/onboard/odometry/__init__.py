"""LiDAR-inertial odometry: where the drone is, from scans and inertial measurements alone."""
