"""Missions as files: trees in the XML of BehaviorTree.CPP v4, read, written, and described for the Groot2 editor."""
