"""What a mission, a command or a test talks to the managers with."""
