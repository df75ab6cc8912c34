"""Drafts of missions for a robot, made from its skillset."""
