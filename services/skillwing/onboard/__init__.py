"""On-board software below the skills: guidance, obstacle detection, odometry, mapping, video, and their messages."""
