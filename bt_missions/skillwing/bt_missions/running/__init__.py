"""The process that flies a mission: node, run, operator requests, published status and tree."""
