"""Page docs/performance.md: each benchmark writes its own section, with figures in one format."""

from __future__ import annotations

import argparse
import datetime
import platform
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from statistics import median, quantiles

from skillwing.services.terminal.doc_sections import Marks, PageError

PAGE = Path(__file__).parents[1] / "docs" / "performance.md"
OMITTED_OPTIONS = {"--write": 0, "--only-kept": 0, "--keep": 1, "--recorded": 1, "--pictures": 1, "--jobs": 1}
"""Options of benchmarks that change no figure, and the number of words that follow each: the page omits them."""


def make_parser(description: str | None) -> argparse.ArgumentParser:
    """Parser with the options of all benchmarks. description: the module's docstring."""
    options = argparse.ArgumentParser(description=(description or "").splitlines()[0])
    options.add_argument("--write", action="store_true", help="put the figures into docs/performance.md")
    return options


def make_flight_parser(description: str | None) -> argparse.ArgumentParser:
    """Parser for benchmarks that fly a mission."""
    options = make_parser(description)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--world", default="courtyard")
    options.add_argument("--seconds", type=float, default=1200.0, help="robot seconds after which to stop")
    return options


def write_section(script: str, title: str, body: str, *, write: bool, file: Path = PAGE, variant: str = "") -> None:
    """Print a section. With `write`, replace the section that `script` wrote before in the page `file`.

    variant: an option with which the script writes a section of its own.
    """
    name = f"{script} {variant.lstrip('-')}" if variant else script
    command = again_by([*script.split(), *variant.split()], sys.argv[1:])
    again = f"`python benchmarks/{command}` measures again and rewrites this section."
    section = f"## {title}\n\n{body.strip()}\n\n{again}"
    sys.stdout.write(section + "\n")
    if write:
        try:
            Marks.of_section(f"benchmarks/{name}").replace_or_append(file, section, title=file.stem.capitalize())
        except PageError as error:
            sys.exit(str(error))


def again_by(fixed: Sequence[str], asked: Sequence[str]) -> str:
    """Command that writes a section again. fixed: words of this section. asked: words of the command line."""
    words = iter([word for word in asked if word not in fixed])
    kept: list[str] = []
    for word in words:
        option, _, value = word.partition("=")
        if option not in OMITTED_OPTIONS:
            kept.append(word)
        elif not value:
            for _ in range(OMITTED_OPTIONS[option]):
                next(words, None)
    return shlex.join([*fixed, *kept, "--write"])


def spread(values: Sequence[float]) -> str:
    """Median, least and largest of some values, as a cell of a table; one value stands for itself."""
    if len(values) < 2:
        return f"{values[0]:.2f}" if values else "-"
    return f"{median(values):.2f} ({min(values):.2f} to {max(values):.2f})"


def spread_said(count: int) -> str:
    """Explanation of the cells made by `spread`, each of `count` flights."""
    return "one flight for each figure" if count == 1 else "median of the flights, least and largest in brackets"


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def percentile_99(values: Sequence[float]) -> float:
    """99th percentile, which is never larger than the largest value."""
    return quantiles(values, n=100, method="inclusive")[-1]


def milliseconds(times: Sequence[float]) -> tuple[str, str]:
    """Median and 99th percentile of some seconds, as cells of a table."""
    return f"{1e3 * median(times):.2f}", f"{1e3 * percentile_99(times):.2f}"


Blocks = Sequence[tuple[Sequence[float], Sequence[float]]]
"""Two series for each block that was measured."""


def block_ratio(blocks: Blocks) -> float:
    """Ratio of two series that took turns: the median of the ratios of their medians, block by block."""
    return median(median(ours) / median(base) for ours, base in blocks)


def ratio(blocks: Blocks) -> str:
    """Ratio of two series that took turns, and its least and largest value among the blocks, as a cell of a table."""
    ratios = [median(ours) / median(base) for ours, base in blocks]
    return f"{block_ratio(blocks):.2f} ({min(ratios):.2f} to {max(ratios):.2f})"


def against(budget: float, measured: float, *, at_least: bool = False) -> str:
    """One word for a kept or missed budget."""
    return "kept" if (measured >= budget if at_least else measured <= budget) else "**missed**"


def machine() -> str:
    """Machine and date of the measurement."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    processors = f"{len(names)} x {names[0]}" if names else platform.machine()
    load = Path("/proc/loadavg")
    busy = f", load {load.read_text(encoding='utf-8').split()[0]}" if load.exists() else ""
    today = datetime.datetime.now(tz=datetime.UTC)
    return f"{processors}, Python {platform.python_version()}{busy}, {today:%Y-%m-%d}"
