"""Obstacle detection: how far the way ahead is free, from depth camera or LiDAR."""
