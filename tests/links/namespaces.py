"""Two network namespaces with a link between them that can be cut: packets that arrive are dropped, without a sign."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from types import TracebackType
from typing import Any, Self

NET = "10.213.77"
ROBOT_ADDRESS, STATION_ADDRESS = f"{NET}.1", f"{NET}.2"
TOOLS = ("ip", "iptables")


def obstacle() -> str | None:
    """Reason why this process cannot make network namespaces; None if it can."""
    if os.geteuid() != 0:
        return "network namespaces need root"
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    if missing:
        return f"there is no {' and no '.join(missing)}"
    name = f"sw{os.getpid()}p"
    if subprocess.run(["ip", "netns", "add", name], capture_output=True, check=False).returncode:
        return "network namespaces cannot be made here"
    rules = _in(name, "iptables", "-w", "-L", "INPUT", check=False)
    _run("ip", "netns", "delete", name)
    return "iptables does not work in a namespace" if rules.returncode else None


class TwoNamespaces:
    """A robot's namespace and a station's, with a veth pair between them. Use it as a context manager."""

    def __init__(self) -> None:
        self.robot, self.station = f"sw{os.getpid()}r", f"sw{os.getpid()}s"
        self.is_cut = False

    def __enter__(self) -> Self:
        try:
            self._make()
        except BaseException:
            self._remove()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._remove()

    def start(self, namespace: str, command: Sequence[str], environment: Mapping[str, str]) -> subprocess.Popen[str]:
        """Start a command in one of the namespaces; its output is a pipe. Its process id is that of the command."""
        return subprocess.Popen(
            ["ip", "netns", "exec", namespace, *command],
            env=os.environ | dict(environment),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )

    def cut(self) -> None:
        """Drop every packet that arrives, on both sides."""
        if not self.is_cut:
            self.is_cut = True
            self._rules("-I")

    def heal(self) -> None:
        """Let packets through again."""
        if self.is_cut:
            self._rules("-D")
            self.is_cut = False

    def _rules(self, act: str) -> None:
        for namespace in (self.robot, self.station):
            _in(namespace, "iptables", "-w", act, "INPUT", "-i", namespace, "-j", "DROP")

    def _make(self) -> None:
        for namespace in (self.robot, self.station):
            _run("ip", "netns", "add", namespace)
            _in(namespace, "ip", "link", "set", "lo", "up")
        _run("ip", "link", "add", self.robot, "type", "veth", "peer", "name", self.station)
        for namespace, address in ((self.robot, ROBOT_ADDRESS), (self.station, STATION_ADDRESS)):
            _run("ip", "link", "set", namespace, "netns", namespace)
            _in(namespace, "ip", "address", "add", f"{address}/30", "dev", namespace)
            _in(namespace, "ip", "link", "set", namespace, "up")

    def _remove(self) -> None:
        for namespace in (self.robot, self.station):
            # The veth pair goes with its namespaces, unless it was not moved there yet.
            subprocess.run(["ip", "netns", "delete", namespace], capture_output=True, check=False)
        subprocess.run(["ip", "link", "delete", self.robot], capture_output=True, check=False)


def _run(*words: str, check: bool = True) -> subprocess.CompletedProcess[Any]:
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if check and done.returncode:
        raise OSError(f"`{' '.join(words)}` failed: {done.stderr.strip()}")
    return done


def _in(namespace: str, *words: str, check: bool = True) -> subprocess.CompletedProcess[Any]:
    return _run("ip", "netns", "exec", namespace, *words, check=check)
