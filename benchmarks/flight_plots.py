"""Pictures of the flights of benchmarks/flight_tests.py, small enough for a page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from flight_trials import PLACE, Flight
from matplotlib.axes import Axes

Flights = dict[str, Flight]


def _draw(file: Path, *panels: Callable[[Axes], None]) -> None:
    figure, axes = plt.subplots(1, len(panels), figsize=(4.2 * len(panels), 3.2), layout="constrained", squeeze=False)
    for panel, draw in zip(axes[0], panels, strict=True):
        draw(panel)
        panel.grid(alpha=0.3)
        panel.spines[["top", "right"]].set_visible(False)
    figure.savefig(file, dpi=80, metadata={"Software": None})
    plt.close(figure)


def _track(flight: Flight) -> tuple[np.ndarray, np.ndarray]:
    return np.array(flight.times), np.array(flight.positions)


def _lines(
    flights: Flights, names: dict[str, str], value: Callable[[Flight], np.ndarray], title: str, y: str
) -> Callable[[Axes], None]:
    """A panel with a line over time for each of these flights, by their labels."""

    def panel(axes: Axes) -> None:
        for name, label in names.items():
            axes.plot(flights[name].times, value(flights[name]), label=label, linewidth=1.2)
        axes.set(title=title, xlabel="time [s]", ylabel=y)
        if len(names) > 1:
            axes.legend(fontsize=7, frameon=False)

    return panel


def _of(flights: Flights, what: str) -> dict[str, str]:
    """Names of the flights of a table, with short labels."""
    names = [name for name in flights if name.startswith(f"{what}")]
    return {
        name: name.partition(": ")[2].partition(" of (")[0].partition(" (")[0].partition(", as")[0] for name in names
    }


def _height(flight: Flight) -> np.ndarray:
    return _track(flight)[1][:, 2]


def _tilt(flight: Flight) -> np.ndarray:
    return np.degrees(flight.tilts)


def _heading(flight: Flight) -> np.ndarray:
    return np.degrees(np.unwrap(flight.headings))


def control(flights: Flights, file: Path) -> None:
    def away(flight: Flight) -> np.ndarray:
        return 100.0 * np.linalg.norm(_track(flight)[1] - np.array(PLACE), axis=1)

    def way(flight: Flight) -> np.ndarray:
        return _track(flight)[1][:, 0] - PLACE[0]

    _draw(
        file,
        _lines(flights, _of(flights, "10 m east"), way, "10 m east", "way [m]"),
        _lines(flights, _of(flights, "turning"), _heading, "90 degrees", "heading [degrees]"),
        _lines(flights, _of(flights, "staying"), away, "staying at a place", "away from it [cm]"),
    )


def landing(flights: Flights, file: Path) -> None:
    names = _of(flights, "height of the hills")
    _draw(
        file,
        _lines(flights, names, _height, "landing and taking off again", "height [m]"),
        _lines(flights, names, _tilt, "by the height of the hills", "tilt [degrees]"),
    )


def fence(flights: Flights, file: Path) -> None:
    def plan(axes: Axes) -> None:
        axes.plot([-20, 50, 50, -20, -20], [-20, -20, 40, 40, -20], color="black", linewidth=1.5)
        for name, flight in flights.items():
            _, places = _track(flight)
            windy = " 8 m/s" in name
            axes.plot(places[:, 0], places[:, 1], color="tab:red" if windy else "tab:blue", linewidth=1.2, alpha=0.7)
        axes.plot([], [], color="tab:blue", label="calm")
        axes.plot([], [], color="tab:red", label="8 m/s from behind")
        axes.legend(fontsize=7, frameon=False, loc="lower right", borderaxespad=2.0)
        axes.set(title="seen from above", xlabel="east [m]", ylabel="north [m]", aspect="equal")

    def gap(flight: Flight) -> np.ndarray:
        return 50.0 - _track(flight)[1][:, 0]

    _draw(file, plan, _lines(flights, _of(flights, "towards the wall: east"), gap, "to the east wall", "distance [m]"))


def rotors(flights: Flights, file: Path) -> None:
    names = {name: label for name, label in _of(flights, "which rotor").items() if label.endswith("stopped")}
    title = "stopped at 7 s"
    _draw(
        file,
        _lines(flights, names, _height, title, "height [m]"),
        _lines(flights, names, _tilt, title, "tilt [degrees]"),
        _lines(flights, names, _heading, title, "heading [degrees]"),
    )


def failsafes(flights: Flights, file: Path) -> None:
    def drift(flight: Flight) -> np.ndarray:
        return np.linalg.norm(_track(flight)[1][:, :2] - np.array(flight.place[:2]), axis=1)

    lost = _of(flights, "no satellite")
    _draw(
        file,
        _lines(flights, _of(flights, "setpoints end"), _height, "setpoints end at 8 s", "height [m]"),
        _lines(flights, _of(flights, "battery"), _height, "battery critical", "height [m]"),
        _lines(flights, lost, drift, "no fixes from 8 or 14 s on", "away [m]"),
    )
