"""`skillwing world`: the worlds that a seed makes, as description, MuJoCo scene and picture."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from skillwing.sim_mujoco.world.site import LARGEST_SEED

if TYPE_CHECKING:
    from skillwing.sim_mujoco.world.world import World

SCENE, PICTURE = ".xml", ".png"


def world(
    kind: Annotated[
        str | None, typer.Argument(metavar="KIND", help="Kind of world; without it, lists those there are.")
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(metavar="N", min=0, max=LARGEST_SEED, help="The same seed, the same world. Default 1."),
    ] = None,
    scale: Annotated[
        float | None, typer.Option(metavar="FACTOR", help="Its size, where its kind has several. Default 1.")
    ] = None,
    output: Annotated[
        list[Path] | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Write the scene for MuJoCo (.xml) or a picture (.png); repeatable."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the site as JSON.")] = False,
) -> None:
    """Show a simulated world: its site as a mission planner has it, its scene for MuJoCo, a picture of it. See
    docs/worlds.md.

    Exit codes: 0 done, 2 unknown kind or scale, or a file that cannot be written.
    """
    files = output or []
    for file in files:
        if file.suffix.lower() not in {SCENE, PICTURE}:
            raise typer.BadParameter(f"`{file}` is neither a scene nor a picture. End it with {SCENE} or {PICTURE}.")
    if kind is None:
        if files or seed is not None or scale is not None:
            raise typer.BadParameter("Which world is meant? Name a KIND; `skillwing world` lists them.")
        _list_kinds(as_json=as_json)
        return
    made = _make(kind, 1 if seed is None else seed, 1.0 if scale is None else scale)
    for file in files:
        if file.suffix.lower() == SCENE:
            _write_scene(file, made)
        else:
            _write_picture(file, made)
        if not as_json:
            typer.echo(f"{file} written.")
    if as_json:
        from dataclasses import asdict  # noqa: PLC0415 - as small as the rest of this branch

        typer.echo(json.dumps(asdict(made.site), indent=2))
    elif not files:
        _print(made)


def _list_kinds(*, as_json: bool) -> None:
    from skillwing.sim_mujoco.world.kinds import KINDS  # noqa: PLC0415 - loads numpy

    if as_json:
        found = [{"kind": name, "summary": each.summary, "scales": each.scales} for name, each in KINDS.items()]
        typer.echo(json.dumps(found, indent=2))
        return
    for name, each in KINDS.items():
        low, high = each.scales
        scales = f" (scale {low:g} to {high:g})" if low < high else ""
        typer.echo(f"{name:12s}{each.summary}{scales}")


def _make(kind: str, seed: int, scale: float) -> World:
    from skillwing.sim_mujoco.world.kinds import KINDS  # noqa: PLC0415 - loads numpy
    from skillwing.sim_mujoco.world.world import make_world  # noqa: PLC0415 - loads physics

    if kind not in KINDS:
        raise typer.BadParameter(f"there is no world of kind `{kind}`. Choose {_one_of(KINDS)}.")
    low, high = KINDS[kind].scales
    if not math.isfinite(scale) or not low <= scale <= high:
        allowed = f"between {low:g} and {high:g}" if low < high else f"of {low:g} only"
        raise typer.BadParameter(f"a {kind} has a scale {allowed}. Give --scale accordingly.")
    return make_world(seed, kind, scale)


def _write_scene(file: Path, made: World) -> None:
    spec = made.spec()
    spec.compile()
    file.write_text(spec.to_xml(), encoding="utf-8")


def _write_picture(file: Path, made: World) -> None:
    # An error of a file that cannot be written comes before the work, not after it.
    file.open("ab").close()
    from skillwing.sim_mujoco.world.picture import draw_world  # noqa: PLC0415 - loads matplotlib

    draw_world(file, made)


def _print(made: World) -> None:
    """Print the site, and then its obstacles, which no mission knows beforehand."""
    site = made.site
    west, south, east, north = site.area
    lines = [
        ("home", _place(site.home)),
        ("route", " ".join(map(_place, site.route))),
        ("detours", f"{_place((west, south))} to {_place((east, north))}"),
        ("geofence", f"{_place(site.fence.low)} to {_place(site.fence.high)}"),
        ("map", f"{_place(site.bounds.low)} to {_place(site.bounds.high)}"),
        ("highest", f"{site.ceiling:g} m; home over everything at {site.return_height:g} m"),
    ]
    if site.target is not None:
        target = site.target
        circle = f"circle of {target.radius:.1f} m around {_place(target.centre)}, at {target.height:g} m"
        lines.append(("inspection", circle))
    counts: dict[str, int] = {}
    for obstacle in made.obstacles:
        counts[obstacle.kind] = counts.get(obstacle.kind, 0) + 1
    lines.append(("there are", ", ".join(f"{count} x {kind}" for kind, count in counts.items())))
    on_legs = [each.name for each in made.obstacles if each.leg is not None]
    lines.append(("on the way", ", ".join(on_legs) or "nothing"))
    for name, text in lines:
        typer.echo(f"{name:12s}{text}")


def _place(place: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{x:.1f}".removesuffix(".0") for x in place) + ")"


def _one_of(names: Iterable[str]) -> str:
    *others, last = names
    return f"{', '.join(others)} or {last}"
