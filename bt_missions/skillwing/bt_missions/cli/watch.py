"""`skillwing mission watch`: live view of the mission that runs: status, tree, skills and branch switches."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.text import Text

from skillwing.bt_missions.running.tree_snapshot import render_tree
from skillwing.services.bus import Answered, Refused
from skillwing.services.bus.reading import message_reader
from skillwing.services.client.causal_feed import follow_records
from skillwing.services.client.retry import ask_until_answered
from skillwing.services.history.history import GoalOutcome, SkillBar
from skillwing.services.history.mission_intervals import mission_intervals, read_phases
from skillwing.services.history.recent_history import RecentHistory
from skillwing.services.history.report import REPORT_FILE, read_report
from skillwing.services.history.report import RESULTS as PHASE_RESULTS
from skillwing.services.history.wording import chain_text, clock_text
from skillwing.services.protocol import (
    GoalProgress,
    GoalStatus,
    MissionPhase,
    MissionStatus,
    QueryMission,
    Record,
    RecordKind,
    TreeNode,
    TreeSnapshot,
    decode,
    encode,
)
from skillwing.services.terminal.connection import System
from skillwing.services.terminal.keyboard import when_pressed
from skillwing.services.terminal.link_monitor import follow_link
from skillwing.services.terminal.live_state import LiveState
from skillwing.services.terminal.output import make_table, relative_path, value_text

SILENCES = 6
"""Silences in a row after which no launcher serves missions."""
PERIOD = 0.25
"""Time between two updates of the view, in seconds of wall time."""
QUIT = "q"
BARS = 10
"""Most goals in the timeline."""
WIDTH = 40
"""Width of the timeline in characters."""
FRAME, FEWEST = 8, 6
"""Lines that are neither tree nor timeline, and lines of the tree on the smallest screen."""
RESULTS = {"success": "succeeded", "failure": "failed", "aborted": "was aborted", "unfinished": "was cut short"}
"""Words for the result of a mission in its report."""
PHASE_COLOURS = {
    MissionPhase.SUCCEEDED: "bold green",
    MissionPhase.FAILED: "bold red",
    MissionPhase.ABORTED: "bold yellow",
    MissionPhase.PAUSED: "bold cyan",
    MissionPhase.HELD: "bold magenta",
}
_BAR_COLOURS = {
    GoalOutcome.RUNNING: "blue",
    GoalOutcome.SUCCESS: "green",
    GoalOutcome.FAILURE: "red",
    GoalOutcome.INTERRUPTED: "bright_black",
}


class MissionWatch:
    """Latest messages of the mission of a system. They arrive while the bus of the connection runs.

    on_link: gets a sentence when the link to the robot is lost, and when it is back. The view shows it, too.
    """

    def __init__(self, system: System, on_link: Callable[[str], None] = lambda sentence: None) -> None:
        self.status: MissionStatus | None = None
        self.tree: TreeSnapshot | None = None
        self._system = system
        self._present = LiveState()
        self._history = RecentHistory(system.skillset)
        self._since = 0.0
        self._on_link = on_link
        self.link = follow_link(system, self._take_link)
        bus, keys = system.bus, system.keys
        bus.subscribe(keys.mission_status, message_reader(MissionStatus, self._on_status), events=True)
        bus.subscribe(keys.mission_tree, message_reader(TreeSnapshot, self._on_tree), events=True)
        follow_records(bus, keys, self._on_record, self._on_goal)
        bus.subscribe(keys.progress("*"), message_reader(GoalProgress, self._present.add_progress), latest_only=True)

    @property
    def over(self) -> bool:
        return self.status is not None and self.status.phase.over

    @property
    def failed(self) -> bool:
        return self.over and self.status is not None and self.status.phase != MissionPhase.SUCCEEDED

    @property
    def complete(self) -> bool:
        """True if both a status and a tree have arrived."""
        return self.status is not None and self.tree is not None

    def view(self, height: int | None = None) -> RenderableType:
        """All that is known, or the result of the last mission if none runs. height: lines of the terminal."""
        warning = [Text(self.link.warning, "bold red")] if self.link.warning else []
        if self.status is None:
            return Group(*warning, Text(self._without_status(), overflow="fold"))
        parts: list[RenderableType] = [
            *warning,
            status_line(self.status, self._system.addressed(self.status.text)),
            Text(),
        ]
        if self.tree is not None:
            parts += [_tree_text(self.tree, height), Text()]
        bars = self._latest_bars()
        if bars:
            parts += [self._timeline(bars), Text()]
        parts += [Text(f"because  {chain_text(switch.chain)}", "yellow") for switch in self._history.switches[-2:]]
        return Group(*parts)

    def _without_status(self) -> str:
        """A sentence for a view that has heard of no mission. On a cut link, one may run all the same."""
        if self.link.warning:
            return "Until then, nothing was heard of a mission here."
        target = self._system.target
        return self._system.addressed(_last_mission(target.run_dir, shared=target.shared))

    def _latest_bars(self) -> list[SkillBar]:
        """The goals of this mission that run, and the latest that ran."""
        bars = [bar for bar in self._history.bars if bar.ran and bar.t_start >= self._since]
        latest = sorted(bars, key=lambda bar: (bar.terminal is None, bar.t_start))[-BARS:]
        return sorted(latest, key=lambda bar: bar.t_start)

    def _timeline(self, bars: list[SkillBar]) -> RenderableType:
        end = max(self._system.bus.now(), *(bar.t_end or bar.t_start for bar in bars))
        start = min(bar.t_start for bar in bars)
        scale = WIDTH / max(end - start, 1.0)
        table = make_table(("SKILL", "", "FROM", "FOR", "IS"))
        for bar in bars:
            until = end if bar.t_end is None else bar.t_end
            before, width = int((bar.t_start - start) * scale), max(1, round((until - bar.t_start) * scale))
            drawn = Text(" " * before).append("█" * width, _BAR_COLOURS[bar.outcome])
            table.add_row(bar.skill, drawn, clock_text(bar.t_start), f"{until - bar.t_start:.1f} s", self._is(bar))
        return table

    def _is(self, bar: SkillBar) -> Text:
        if bar.terminal is not None:
            return Text(bar.terminal, f"bold {_BAR_COLOURS[bar.outcome]}")
        now = self._present.skill(bar.skill)
        return Text(value_text(now.feedback) if now.feedback and now.goal_id == bar.goal_id else "running", "blue")

    def _take_link(self, sentence: str) -> None:
        """Pass a sentence on. When the link is back, the mission may have ended meanwhile: its launcher knows."""
        self._on_link(sentence)
        if self._system.bus.connected:
            ask_latest_status(self._system, self._on_status)

    def _on_status(self, status: MissionStatus) -> None:
        self.status = status

    def _on_tree(self, tree: TreeSnapshot) -> None:
        self.tree = tree

    def _on_record(self, record: Record) -> None:
        if record.kind is not RecordKind.DATA:
            self._history.add_record(record)
        if record.kind is RecordKind.MISSION and (record.before, record.after) == (
            MissionPhase.IDLE,
            MissionPhase.RUNNING,
        ):
            self._since = max(self._since, record.t)

    def _on_goal(self, status: GoalStatus) -> None:
        self._history.add_status(status)
        self._present.add_status(status)


def ask_latest_status(
    system: System,
    take: Callable[[MissionStatus], None],
    request_id: str = "",
    on_refusal: Callable[[], None] = lambda: None,
) -> None:
    """Ask the robot's launcher for the latest status of a mission, or of the one of a request. Without a launcher,
    nothing is called. on_refusal: it knows none."""

    def on_answer(answer: Answered | Refused) -> None:
        if isinstance(answer, Answered):
            take(decode(answer.payload, MissionStatus))
        else:
            on_refusal()

    ask_until_answered(
        *(system.bus, system.keys.mission_status, encode(QueryMission(request_id=request_id)), on_answer),
        keep_retrying=lambda silences: silences < SILENCES,
    )


def show_live(system: System, watch: MissionWatch, console: Console) -> None:
    """Show the view live until the mission is over or q is pressed. The last view stays on the terminal."""
    pressed: set[str] = set()
    with (
        Live(watch.view(console.height), console=console, screen=True, auto_refresh=False) as live,
        when_pressed(lambda key: system.bus.post(lambda: pressed.add(key))),
    ):
        while QUIT not in pressed and not watch.over:
            system.bus.run_until(lambda: QUIT in pressed or watch.over, PERIOD)
            live.update(watch.view(console.height), refresh=True)
    console.print(watch.view())


def _last_mission(run_dir: Path | None, *, shared: bool) -> str:
    """Sentence for a system without a mission: the result of the last one that began, and its report.

    Both are taken from the recording, as the report is written seconds after the end. Without a record of the end, the
    report may know it. shared: missions use this robot and occupy others, where their status and report are.
    """
    missions = () if run_dir is None else mission_intervals(read_phases(run_dir).records)
    if run_dir is None or not missions:
        return "No mission runs now, and none has run here. Start one with `skillwing mission run`."
    last, folder = missions[-1], run_dir / missions[-1].name
    reported = (folder / REPORT_FILE).exists()
    result = PHASE_RESULTS.get(last.phase or "", "unfinished")
    became = RESULTS[read_report(folder).result if reported else result]
    where = f"its report is in {relative_path(folder)}" if reported else "its report is not written yet"
    if not shared:
        return f"No mission runs now. The last one, `{last.mission}`, {became}; {where}."
    if not reported:
        became = "runs, or was cut short" if last.phase is None else became
        where = "its report is in the run of the robot that it occupies"
    used = f"The last one that used it, `{last.mission}`, {became}"
    return f"No mission occupies this robot, which is shared. {used}; {where}."


def status_line(status: MissionStatus, text: str | None = None) -> Text:
    """Robot time, phase, waypoints and text of a status, in one line. text: in place of its own."""
    line = Text(f"{clock_text(status.t):>9}  ")
    line.append(f"{status.phase:9}", PHASE_COLOURS.get(status.phase, "default"))
    if status.waypoints:
        line.append(f"  {status.waypoint}/{status.waypoints}", "dim")
    return line.append(f"  {status.text if text is None else text}")


def _tree_text(tree: TreeSnapshot, height: int | None) -> Text:
    """The tree, or its most important lines on a small screen."""
    text = render_tree(tree)
    room = None if height is None else max(FEWEST, height - BARS - FRAME)
    if room is None or len(tree.nodes) <= room:
        return text
    lines = text.split("\n")
    parents = {node.parent for node in tree.nodes}
    ranked = sorted(tree.nodes, key=lambda node: (_rank(node, is_leaf=node.index not in parents), node.index))
    return Text("\n").join(lines[node.index] for node in sorted(ranked[:room], key=lambda node: node.index))


def _rank(node: TreeNode, *, is_leaf: bool) -> int:
    """Rank of a line on a small screen: first leaves that run or failed, then the nodes above them."""
    order = (("RUNNING", True), ("FAILURE", True), ("RUNNING", False), ("FAILURE", False), ("SUCCESS", True))
    return order.index((node.status, is_leaf)) if (node.status, is_leaf) in order else len(order)
