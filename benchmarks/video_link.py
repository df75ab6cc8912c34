"""The live video over a link that narrows: figures and the plot of docs/video.md.

    python benchmarks/video_link.py [--no-times] [--write] [--pictures FOLDER]

Streams the flight around the inspection building (seed 1) over links of constant bandwidth, over links that lose
packets, and once around through two zones. Times of processing are processor times.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from statistics import mean, median
from typing import TypeVar

import matplotlib as mpl
import numpy as np
from performance_page import machine, make_parser, table, write_section
from video_trial import START_UP, Album, Orbiter, Trial, inspection_world, stream

from skillwing.onboard.video.codec import Decoder, Encoder
from skillwing.onboard.video.similarity import similarity
from skillwing.sim_mujoco.camera.camera import Camera, Picture
from skillwing.sim_mujoco.sensors.depth_pictures import HEIGHT, WIDTH
from skillwing.sim_mujoco.world.rays import RayScene
from skillwing.sim_mujoco.world.world import World

mpl.use("Agg")
from matplotlib import pyplot as plt

T = TypeVar("T")
PAGE = Path(__file__).parents[1] / "docs" / "video.md"
PLOT = PAGE.parent / "images" / "video_link.png"
SEED = 1
WIDE, SETTLED = 4.0, 10.0
"""Every trial begins on a wide link, and figures count from so long after its start [s]."""
CONSTANT = (2.0, 1.0, 0.5, 0.25, 0.12, 0.06, 0.03)
LOSSES = (0.01, 0.03, 0.1, 0.2)
MILD = {"center": [48.0, 0.0], "radius": 9.0, "edge": 5.0, "bandwidth": 0.2, "latency": 0.08, "loss": 0.01}
CRITICAL = {"center": [28.0, 20.0], "radius": 9.0, "edge": 5.0, "bandwidth": 0.02, "latency": 0.25, "loss": 0.05}


def row(name: str, trial: Trial) -> list[str]:
    """Name, bit rate, FPS, SSIM, latency p50 and p95, lost packets, changes of the rates, how it ended."""
    seen = trial.settled(START_UP + SETTLED) if trial.ended == "goes on" else trial.seen[-8:]
    quality = [s.quality for s in seen if s.quality is not None]
    delays = sorted(delay for t, delay in trial.delays if t >= seen[0].t)
    p95 = delays[int(0.95 * len(delays))] if delays else float("nan")
    end = (
        trial.ended
        if trial.ended == "goes on"
        else f"{trial.ended.removeprefix('S_')} after {trial.after - WIDE:.1f} s"
    )
    return [
        name,
        f"{mean(s.bitrate for s in seen) / 1e3:.0f}",
        f"{mean(s.fps for s in seen):.1f}",
        f"{mean(quality):.3f}" if quality else "-",
        f"{1e3 * median(delays):.0f}" if delays else "-",
        f"{1e3 * p95:.0f}" if delays else "-",
        f"{100 * mean(s.lost for s in seen):.1f}",
        str(trial.aimed[-1].changes if trial.aimed else 0),
        end,
    ]


HEADS = ["kbit/s received", "FPS", "SSIM", "latency p50 [ms]", "p95 [ms]", "lost [%]", "changes of rate", "the skill"]


def costs(world: World, album: Album) -> str:
    """Processor time for one picture, in a sentence: medians over 4 s of the flight at 400 kbit/s."""
    orbiter, camera = Orbiter(world, album), Camera(world, RayScene(world.triangles()))
    encoder, decoder = Encoder(WIDTH, HEIGHT, 15.0), Decoder()
    times: dict[str, list[float]] = {}

    def timed(name: str, call: Callable[[], T]) -> T:
        begun = time.process_time()
        result = call()
        times.setdefault(name, []).append(1e3 * (time.process_time() - begun))
        return result

    def encode(picture: Picture, t: float) -> bytes:
        unit = encoder.encode(picture, t, 4e5, 15.0, keyframe=False)
        return unit.data if unit is not None else b""

    for k in range(60):
        motion = orbiter.motion(k / 15.0)
        picture = timed("to render", lambda motion=motion: camera.picture(motion))
        data = timed("to encode", lambda picture=picture, motion=motion: encode(picture, motion.t))
        seen = timed("to decode", lambda data=data: decoder.decode(data))
        timed("for its SSIM", lambda picture=picture, seen=seen: similarity(picture, seen))
    told = ", ".join(f"{median(each):.1f} ms {name}" for name, each in times.items())
    return f"Processor time for one picture (median, at 400 kbit/s): {told}."


def plot(trial: Trial, file: Path) -> None:
    """Bandwidth and bit rates, frame rate, quality over time, with the zones shaded."""
    figure, axes = plt.subplots(3, 1, sharex=True, figsize=(9.0, 6.4), constrained_layout=True)
    link = np.array([(s.t, s.bandwidth / 1e3) for s in trial.links])
    aimed = np.array([(s.t, s.bitrate / 1e3, s.fps) for s in trial.aimed])
    seen = np.array([(s.t, s.bitrate / 1e3, s.fps, np.nan if s.quality is None else s.quality) for s in trial.seen])
    axes[0].semilogy(*link.T, color="#9aa4b2", label="bandwidth of the link")
    axes[0].step(aimed[:, 0], aimed[:, 1], where="post", color="#e69f00", label="bit rate aimed at")
    axes[0].plot(seen[:, 0], np.maximum(seen[:, 1], 5.0), color="#0072b2", label="received on the ground")
    axes[0].set_ylabel("kbit/s")
    axes[1].step(aimed[:, 0], aimed[:, 2], where="post", color="#e69f00", label="aimed at")
    axes[1].plot(seen[:, 0], seen[:, 2], color="#0072b2", label="seen on the ground")
    axes[1].axhline(10.0, color="#d55e00", lw=1, ls="--", label="min_fps")
    axes[1].set(ylabel="pictures a second", ylim=(0, 17))
    axes[2].plot(seen[:, 0], seen[:, 3], color="#0072b2", label="seen on the ground")
    axes[2].axhline(0.7, color="#d55e00", lw=1, ls="--", label="min_quality")
    axes[2].set(ylabel="SSIM", xlabel="robot time [s]", ylim=(0.5, 1.0))
    end = START_UP + trial.after
    for axis in axes:
        narrow = link[:, 1] < 0.5 * link[:, 1].max()
        axis.fill_between(
            link[:, 0], 0, 1, where=narrow, transform=axis.get_xaxis_transform(), color="#d55e00", alpha=0.1
        )
        if trial.ended != "goes on":
            axis.axvline(end, color="black", lw=1)
        axis.grid(alpha=0.25)
        axis.legend(loc="lower left", fontsize=8)
    if trial.ended != "goes on":
        axes[0].annotate(
            trial.ended.removeprefix("S_"),
            (end, axes[0].get_ylim()[1]),
            (-4, -12),
            textcoords="offset points",
            ha="right",
        )
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=110)
    plt.close(figure)


def main() -> None:
    parser = make_parser(__doc__)
    parser.add_argument("--no-times", action="store_true", help="tell no times, on a machine that has other work")
    parser.add_argument("--pictures", type=Path, help="keep what the ground saw last in each trial")
    options = parser.parse_args()
    world = inspection_world(SEED)
    album = Album(world)

    def told(name: str, trial: Trial) -> Trial:
        sys.stderr.write(f"{name}: {trial.ended} after {trial.after:.1f} s\n")
        if options.pictures is not None and trial.shown:
            options.pictures.mkdir(parents=True, exist_ok=True)
            (options.pictures / f"{name.replace(' ', '_')}.jpg").write_bytes(trial.shown[-1][1])
        return trial

    radio = {"reach": 1e6, "seed": SEED}

    def short(name: str, bandwidth: float, loss: float = 0.0) -> Trial:
        narrow = {"kind": "narrow", "at": START_UP + WIDE, "magnitude": bandwidth}
        link = radio | {"bandwidth": CONSTANT[0], "loss": loss, "faults": [narrow]}
        return told(name, stream(world, album, WIDE + 18.0, link))

    constant = [row(f"{b:g}", short(f"{b:g} Mbit", b)) for b in CONSTANT]
    lossy = [row(f"{100 * p:g}", short(f"{100 * p:g} percent", 1.0, p)) for p in LOSSES]
    around = told("around", stream(world, album, 60.0, radio | {"bandwidth": 2.0, "zones": [MILD, CRITICAL]}))
    plot(around, PLOT if options.write else Path("video_link.png"))
    entered = next((s.t for s in around.links if s.bandwidth < 5e4), float("nan"))
    body = "\n\n".join(
        [
            f"{machine()}; world `inspection`, seed {SEED}; `stream(min_fps=10, min_quality=0.7)`, on a link that is "
            f"{CONSTANT[0]:g} Mbit/s wide for {WIDE:g} s and then as narrow as the table says; figures from "
            f"{SETTLED - WIDE:g} s later on, or of the last 2 s before the skill's end. Latency is a picture's, from "
            "its shutter to the packet with which it can be decoded; camera and codec take no robot time."
            + ("" if options.no_times else f" {costs(world, album)}"),
            table(["bandwidth [Mbit/s]", *HEADS], constant),
            "With a bandwidth of 1 Mbit/s and packet loss in the channel:",
            table(["loss [%]", *HEADS], lossy),
            "Around the building through a mild zone (0.2 Mbit/s, 1 % lost) and into a critical one (0.02 Mbit/s): "
            f"the skill {'goes on' if around.ended == 'goes on' else 'ends ' + around.ended.removeprefix('S_')} "
            f"{around.after:.1f} s after its start, {START_UP + around.after - entered:.1f} s after the bandwidth fell "
            f"below 0.05 Mbit/s.",
            "![Bandwidth, rates, frames and quality over time](images/video_link.png)",
        ]
    )
    write_section("video_link.py", "Measured", body, write=options.write, file=PAGE)


if __name__ == "__main__":
    main()
