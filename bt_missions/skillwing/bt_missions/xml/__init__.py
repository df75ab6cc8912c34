"""Missions as tree files: XML of BehaviorTree.CPP v4, read and written, with a palette for the Groot2 editor."""
