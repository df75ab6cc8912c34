"""Whether a mission fits a robot and itself, before it flies."""
