"""Battery percentage to battery status, without chatter at the thresholds."""

from __future__ import annotations

from enum import StrEnum

LOW_BELOW, CRITICAL_BELOW = 30.0, 15.0
HYSTERESIS = 3.0
"""A better status needs this much more than the threshold [%]."""


class BatteryStatus(StrEnum):
    """States of the resource `battery_status`."""

    NORMAL = "NORMAL"
    LOW = "LOW"
    CRITICAL = "CRITICAL"


class BatteryLevel:
    """Classifies percentages: worse at once, better only with some reserve. Pure."""

    def __init__(self) -> None:
        self.status: BatteryStatus | None = None

    def update(self, percent: float) -> BatteryStatus:
        """Take a percentage (0 to 100) and return the status from now on."""
        margin_critical = HYSTERESIS if self.status is BatteryStatus.CRITICAL else 0.0
        margin_low = HYSTERESIS if self.status in (BatteryStatus.CRITICAL, BatteryStatus.LOW) else 0.0
        if percent < CRITICAL_BELOW + margin_critical:
            self.status = BatteryStatus.CRITICAL
        elif percent < LOW_BELOW + margin_low:
            self.status = BatteryStatus.LOW
        else:
            self.status = BatteryStatus.NORMAL
        return self.status
