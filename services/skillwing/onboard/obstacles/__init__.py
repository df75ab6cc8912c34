"""Obstacle detection: the free distance ahead, from depth camera or LiDAR, and places to land."""
