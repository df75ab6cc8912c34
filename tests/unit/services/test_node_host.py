"""Hosting of a node: errors before the node exists."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from skillwing.dsl import parse
from skillwing.services.bus.clock import unix_offset
from skillwing.services.errors import InvalidOptionError
from skillwing.services.journal.errors import JournalRefusedError, JournalUnreadableError, JournalWriteError
from skillwing.services.managers.resource_manager import ResourceManagerNode
from skillwing.services.processes import node_host
from skillwing.services.processes.lifetime import EXIT_CONFIGURATION, EXIT_PASSING
from skillwing.services.processes.node_host import make_clock, make_node
from skillwing.services.robot import ProcessSpec


def picky(options: dict[str, Any]) -> None:
    raise ValueError(f"`seed` is {options['seed']}; it has to be positive.")


def test_an_option_that_a_factory_refuses_is_named() -> None:
    with pytest.raises(InvalidOptionError, match=r"`seed` is -1; it has to be positive\."):
        make_node(ProcessSpec("picky", f"{__name__}:picky", {"seed": -1}))


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (JournalWriteError, EXIT_PASSING),
        (JournalUnreadableError, EXIT_PASSING),
        (JournalRefusedError, EXIT_CONFIGURATION),
    ],
)
def test_only_what_will_fail_again_is_given_up(
    error: type[JournalRefusedError], code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A journal that is locked for a second must not ground the robot."""

    def unlucky(options: dict[str, Any]) -> None:
        raise error(Path("journal.sqlite"), "It cannot be had.")

    monkeypatch.setattr(node_host, "Lifetime", lambda parent_pipe: None)
    monkeypatch.setattr(node_host, "imported", lambda options, name: unlucky)
    words = ["--name", "judge", "--factory", "x:y", "--connect", "tcp/127.0.0.1:1", "--robot", "r"]
    assert node_host.main(words) == code
    assert capsys.readouterr().err == "It cannot be had.\n"


def test_a_process_that_is_started_again_has_the_time_of_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """The machine's clock was set back meanwhile. New messages must not look older than earlier ones."""
    node = ResourceManagerNode(parse("skillset still { resource lamp { initial OFF } }", "still.skillset"))
    offset = unix_offset()
    before = make_clock(node, "wall", {}, offset).now()
    monkeypatch.setattr("time.time", lambda: 0.0)
    assert make_clock(node, "wall", {}, offset).now() >= before > 1e9


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["--process", "a", "--process", "a"], "each node of a process has a name of its own"),
        (["--name", "a", "--factory", "x:y", "--name", "b"], "--factory is given 1 times for 2 nodes"),
        (["--process", "a", "--process", "b", "--alive", "k"], "--alive is given 1 times for 2 nodes"),
        (["--process", "a", "--topology", "ring"], "the topology is `router` or `mesh`, not `ring`"),
        (["--process", "a", "--name", "b", "--factory", "x:y"], "either --process, or --name and --factory"),
    ],
)
def test_words_that_do_not_go_together_are_refused(
    words: list[str], problem: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        node_host.main([*words, "--connect", "tcp/127.0.0.1:1", "--robot", "r"])
    assert problem in capsys.readouterr().err


def test_of_several_nodes_the_one_that_cannot_be_made_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(node_host, "Lifetime", lambda parent_pipe: None)
    factories = {"good": lambda options: ResourceManagerNode(parse("skillset s { resource r { initial A } }", "s"))}
    monkeypatch.setattr(node_host, "imported", lambda options, name: factories.get(options["factory"], picky))
    words = ["--name", "first", "--factory", "good", "--options", "{}"]
    words += ["--name", "second", "--factory", "picky", "--options", '{"seed": -1}']
    assert node_host.main([*words, "--connect", "tcp/127.0.0.1:1", "--robot", "r"]) == EXIT_CONFIGURATION
    assert capsys.readouterr().err.startswith("second: ")
