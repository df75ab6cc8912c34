"""The process that runs a mission: node, run, operator requests, published status and tree."""
