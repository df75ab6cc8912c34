"""What a mission, a command, a script or a test talks to the managers with."""
