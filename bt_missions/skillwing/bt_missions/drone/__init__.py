"""What is a drone's in missions: subtrees for take-off, flight with a depth map, landing and rescue."""
