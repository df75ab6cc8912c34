"""`skillwing doctor`: problems of the system, with remedies."""

from __future__ import annotations

import msgspec
import typer
from rich.console import Console
from rich.text import Text

from skillwing.services.diagnosis.examination import examine
from skillwing.services.diagnosis.findings import Finding, conclusion, diagnose
from skillwing.services.terminal.connection import JsonOption, RobotOption, addressed
from skillwing.services.terminal.exit_codes import FAILED, OK
from skillwing.services.terminal.output import make_console, print_json


def doctor(robot: RobotOption = None, as_json: JsonOption = False) -> None:
    """Show problems of the running system and this machine, with remedies, and change nothing. See docs/operations.md.

    Exit codes: 0 nothing serious, 1 a serious problem.
    """
    evidence = examine(robot)
    name = evidence.system.robot if evidence.system else None
    findings = [_addressed(finding, name, named=robot is not None) for finding in diagnose(evidence)]
    if as_json:
        print_json({"robot": name, "findings": findings})
    else:
        _print(make_console(), name, findings)
    raise typer.Exit(FAILED if any(finding.serious for finding in findings) else OK)


def _addressed(finding: Finding, robot: str | None, *, named: bool) -> Finding:
    """A finding whose remedy chooses this robot, where it has to."""
    if robot is None:
        return finding
    return msgspec.structs.replace(finding, remedy=addressed(finding.remedy, robot, named=named))


def _print(console: Console, name: str | None, findings: list[Finding]) -> None:
    for finding in findings:
        mark = Text("wrong ", "bold red") if finding.serious else Text("note  ", "bold yellow")
        console.print(Text.assemble(mark, finding.what))
        console.print(Text.assemble("      ", finding.remedy, style="dim"))
    if (sentence := conclusion(name, findings)) is not None:
        console.print(sentence, style="yellow" if findings else "green", markup=False)
