"""Hosting a node: what goes wrong before there is one."""

from __future__ import annotations

from typing import Any

import pytest

from skillwing.services.errors import InvalidOptionError
from skillwing.services.processes.node_host import make_node
from skillwing.services.robot import ProcessSpec


def picky(options: dict[str, Any]) -> None:
    raise ValueError(f"`seed` is {options['seed']}; it has to be positive.")


def test_an_option_that_a_factory_refuses_is_named() -> None:
    with pytest.raises(InvalidOptionError, match=r"`seed` is -1; it has to be positive\."):
        make_node(ProcessSpec("picky", f"{__name__}:picky", {"seed": -1}))
