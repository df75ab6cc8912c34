"""`skillwing graph`: pictures of a skillset."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from skillwing.dsl import parse
from skillwing.dsl.commands.source import read, usage_error, write
from skillwing.dsl.model import Skillset
from skillwing.dsl.printing.pictures.diagram import Diagram
from skillwing.dsl.printing.pictures.dot import to_dot
from skillwing.dsl.printing.pictures.mermaid import to_mermaid
from skillwing.dsl.printing.pictures.placement import PicturesUnavailableError
from skillwing.dsl.printing.pictures.subjects import map_diagram, resource_diagram, skill_diagram
from skillwing.dsl.printing.pictures.svg import to_svg


class PictureFormat(StrEnum):
    SVG = "svg"
    DOT = "dot"
    MERMAID = "mermaid"


_PRINTERS = {PictureFormat.SVG: to_svg, PictureFormat.DOT: to_dot, PictureFormat.MERMAID: to_mermaid}
_EXTENSIONS = {
    ".svg": PictureFormat.SVG,
    ".dot": PictureFormat.DOT,
    ".gv": PictureFormat.DOT,
    ".mmd": PictureFormat.MERMAID,
}
_EXTENSION = {PictureFormat.SVG: "svg", PictureFormat.DOT: "dot", PictureFormat.MERMAID: "mmd"}


def graph(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Skillset file.", show_default=False)],
    resource: Annotated[
        str | None, typer.Option(metavar="NAME", help="Draw the state machine of this resource.")
    ] = None,
    skill: Annotated[
        str | None, typer.Option(metavar="NAME", help="Draw the machine of this skill, with its own names.")
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Draw all pictures, each into a file of the directory that -o names.")
    ] = False,
    written_as: Annotated[
        PictureFormat | None, typer.Option("--format", help="What to write; the extension of -o decides, or else svg.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="PATH", help="File to write, or directory with --all.", show_default=False
        ),
    ] = None,
) -> None:
    """Draw a skillset: all skills with their resources, or one resource or skill. See docs/tools.md."""
    if sum((resource is not None, skill is not None, everything)) > 1:
        usage_error("Choose one of `--resource`, `--skill` and `--all`.")
    if everything and output is None:
        usage_error("`--all` draws many pictures. Name a directory for them: `--all -o pictures`.")
    extension = output.suffix.lower() if output is not None and not everything else ""
    if extension and written_as is None and extension not in _EXTENSIONS:
        usage_error(f"`{extension}` cannot be written. Name a file in {', '.join(_EXTENSIONS)}, or give `--format`.")
    form = written_as or _EXTENSIONS.get(extension, PictureFormat.SVG)
    skillset = parse(read(file), str(file))
    try:
        if everything and output is not None:
            _draw_all(skillset, form, output)
            return
        text = _PRINTERS[form](_diagram(skillset, resource, skill))
    except PicturesUnavailableError as error:
        usage_error(str(error))
    if output is None:
        typer.echo(text, nl=False)
    else:
        write(output, text, make_folder=True)


def _diagram(skillset: Skillset, resource: str | None, skill: str | None) -> Diagram:
    """The requested picture. Raises UnknownNameError."""
    if resource is not None:
        return resource_diagram(skillset.resource(resource))
    return map_diagram(skillset) if skill is None else skill_diagram(skillset.skill(skill))


def _draw_all(skillset: Skillset, form: PictureFormat, directory: Path) -> None:
    diagrams = {"skillset": map_diagram(skillset)}
    diagrams |= {f"resource-{resource.name}": resource_diagram(resource) for resource in skillset.resources}
    diagrams |= {f"skill-{skill.name}": skill_diagram(skill) for skill in skillset.skills}
    for name, diagram in diagrams.items():
        write(directory / f"{name}.{_EXTENSION[form]}", _PRINTERS[form](diagram), make_folder=True)
    typer.echo(f"{directory}: {len(diagrams)} pictures of `{skillset.name}`.")
