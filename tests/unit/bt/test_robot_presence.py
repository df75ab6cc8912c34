"""Presence of a robot: it is lost when it is silent, and not when the mission itself hears nobody."""

from __future__ import annotations

from fake_interface import FakeMission

from skillwing.bt_missions.running.robot_presence import LOST_AFTER, RobotPresence
from skillwing.services.bus.inprocess import InProcessNetwork
from skillwing.services.protocol import Keys

KEYS = Keys("toy")


class Watched:
    """A robot of one process, and a mission that watches it. connected: the link of the mission."""

    def __init__(self) -> None:
        self.network = InProcessNetwork()
        self.connected = True
        self.context = FakeMission(robot="left").context
        self.process = self.network.bus("skill/go").declare_alive(KEYS.alive("skill/go"))
        bus = self.network.bus("mission")
        self.presence = RobotPresence(bus, KEYS, self.context, lambda: None, lambda: self.connected)
        self.network.run_for(1.0)

    def is_lost_after(self, seconds: float) -> bool:
        self.network.run_for(seconds)
        return bool(self.context.absence)


def test_a_robot_that_is_silent_for_five_seconds_is_lost_until_it_is_heard_again() -> None:
    watched = Watched()
    watched.process.cancel()
    assert not watched.is_lost_after(LOST_AFTER - 0.1)
    assert watched.is_lost_after(0.2)
    watched.network.bus("skill/go, again").declare_alive(KEYS.alive("skill/go"))
    assert not watched.is_lost_after(0.1)


def test_a_mission_that_hears_nobody_judges_no_robot_until_it_has_listened_again() -> None:
    """A shared router that is started again must not cost a fleet its mission."""
    watched = Watched()
    watched.connected = False
    watched.process.cancel()
    assert not watched.is_lost_after(60.0)
    watched.connected = True
    assert not watched.is_lost_after(LOST_AFTER - 0.1)
    assert watched.is_lost_after(LOST_AFTER + 0.2), "it is silent, too, while others are heard"
