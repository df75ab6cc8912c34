"""A flight of the M600 in the simulator, whose disk is full for a while."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep

from full_disk_figures import MissionOutage

from skillwing.services.history.recording_state import read_state
from skillwing.services.history.report import REPORT_FILE, read_report
from small_disk import full

CLI = [sys.executable, "-m", "skillwing.services.terminal.cli"]
LONGEST = 900.0
"""Wall seconds that the flight may take."""
LOOK_PERIOD = 0.5


def fly(disk: Path, seconds: float, after: float) -> MissionOutage:
    """Fly the mapping mission of the demo, and keep the disk full for some wall seconds.

    after: wall seconds from the mission's begin.
    """
    run_dir = disk / "run"
    words = [*CLI, "demo", "mapping", "--viewer", "none", "--run-dir", str(run_dir), "--keep", "100MB"]
    with (disk.parent / "demo.log").open("w+", encoding="utf-8") as log:
        process = subprocess.Popen(words, stdout=log, stderr=subprocess.STDOUT)
        try:
            _wait_for_mission(run_dir, process)
            _wait(process, after)
            with full(disk):
                _wait(process, seconds)
            code = process.wait(timeout=LONGEST)
        finally:
            process.terminate()
            process.wait(timeout=60)
        log.seek(0)
        output = log.read()
    return _judge(run_dir, code, output, seconds)


def _judge(run_dir: Path, code: int, output: str, seconds: float) -> MissionOutage:
    gaps = read_state(run_dir).gaps
    report = read_report(run_dir) if (run_dir / REPORT_FILE).is_file() else None
    replayed = subprocess.run(
        [*CLI, "replay", str(run_dir), "--json"], capture_output=True, text=True, check=False, timeout=LONGEST
    )
    found = MissionOutage(
        begin=gaps[0].begin if gaps else float("nan"),
        seconds=seconds,
        code=code,
        result="no report" if report is None else report.result,
        missing=[] if report is None else list(report.missing),
        same=replayed.returncode == 0 and bool(json.loads(replayed.stdout)["same"]),
    )
    promises = {
        "The recorder noticed no full disk.": bool(gaps),
        "The recorder does not write again.": bool(gaps) and gaps[-1].end is not None,
        f"The mission did not succeed: {output[-400:]}": code == 0,
        "The report does not say what is missing.": bool(found.missing),
        f"The replay ended with {replayed.returncode}: {replayed.stderr}": found.same,
        "The output has a traceback.": "Traceback" not in output,
    }
    found.problems += [problem for problem, kept in promises.items() if not kept]
    return found


def _wait_for_mission(run_dir: Path, process: subprocess.Popen[bytes]) -> None:
    end = monotonic() + 120.0
    while not (run_dir / "missions.jsonl").exists() and process.poll() is None and monotonic() < end:
        sleep(LOOK_PERIOD)


def _wait(process: subprocess.Popen[bytes], seconds: float) -> None:
    """Wait some wall seconds, or until the process ends."""
    end = monotonic() + seconds
    while process.poll() is None and monotonic() < end:
        sleep(LOOK_PERIOD)
