"""The simulated world as MuJoCo sees it: hexacopter, wind, battery, rotor faults, clearance."""
