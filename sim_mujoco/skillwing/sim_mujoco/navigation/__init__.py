"""Navigation: inertial, aided by satellite fixes, air pressure and odometry."""
