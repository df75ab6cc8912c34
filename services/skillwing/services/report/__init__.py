"""Reports and pictures of the missions of a run, made from its files."""
