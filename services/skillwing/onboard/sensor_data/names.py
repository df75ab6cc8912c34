"""Names of sensors in faults, messages of health and options."""

from __future__ import annotations

from typing import Final

ZED: Final = "zed"
LIDAR: Final = "lidar"
IMU: Final = "imu"
RANGE: Final = "range"
GNSS: Final = "gnss"
CAMERA: Final = "camera"
