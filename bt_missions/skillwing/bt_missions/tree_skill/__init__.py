"""Skills whose body is a tree over other skills."""
