"""Where the drone is: inertial navigation, kept true by satellite fixes and air pressure."""
