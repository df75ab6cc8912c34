# Only what the simulator uses.
