"""Mapping: an occupancy grid from LiDAR scans."""
