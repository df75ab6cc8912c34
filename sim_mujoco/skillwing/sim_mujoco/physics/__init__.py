"""The simulated vehicle: hexacopter under MuJoCo, wind, battery, rotor faults, clearance."""
