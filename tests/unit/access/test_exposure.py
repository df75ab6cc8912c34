"""Addresses: which ones strangers can reach, and what they need."""

from __future__ import annotations

from pathlib import Path

import pytest

from skillwing.services.access.exposure import exposed, is_loopback, local_endpoint, require_address, require_protected
from skillwing.services.bus.address import is_address
from skillwing.services.errors import InvalidOptionError

HERE = ["tcp/127.0.0.1:1", "tcp/127.3.2.1:1", "tcp/localhost:1", "tcp/[::1]:1"]
ELSEWHERE = ["tcp/0.0.0.0:1", "tcp/[::]:1", "tcp/10.0.0.5:1", "tcp/robot.local:1", "tcp/[fe80::1]:1"]


def test_loopback_needs_nothing() -> None:
    for listen in HERE:
        assert is_loopback(listen)
        assert not exposed(listen)
        require_protected(listen, None, insecure=False)


@pytest.mark.parametrize("listen", ELSEWHERE)
def test_any_other_address_needs_keys_or_a_word(listen: str) -> None:
    assert exposed(listen)
    with pytest.raises(InvalidOptionError, match="--insecure"):
        require_protected(listen, None, insecure=False)
    require_protected(listen, None, insecure=True)
    require_protected(listen.replace("tcp", "tls"), Path("keys"), insecure=False)
    assert not exposed(listen.replace("tcp", "tls"))


def test_keys_and_addresses_go_together() -> None:
    with pytest.raises(InvalidOptionError, match="tls/HOST:PORT"):
        require_protected("tcp/127.0.0.1:1", Path("keys"), insecure=True)
    with pytest.raises(InvalidOptionError, match="keys init"):
        require_protected("tls/127.0.0.1:1", None, insecure=True)


def test_processes_of_the_machine_find_a_router_at_all_addresses() -> None:
    assert local_endpoint("tls/0.0.0.0:7447") == "tls/127.0.0.1:7447"
    assert local_endpoint("tcp/[::]:7447") == "tcp/[::1]:7447"
    assert local_endpoint("tcp/10.0.0.5:7447") == "tcp/10.0.0.5:7447"


@pytest.mark.parametrize(
    "address", [*HERE, *ELSEWHERE, "tls/robot.local:65535", "tcp/10.0.0.5:1#iface=eth0", "tcp/[fe80::1%eth0]:1"]
)
def test_addresses_of_routers(address: str) -> None:
    assert is_address(address)
    require_address(address, "router")


@pytest.mark.parametrize(
    "text", ["", "foo", "tcp/127.0.0.1", "tcp/:7447", "127.0.0.1:7447", "tcp/robot:65536", "tcp/a:b", "tcp/8.8.8.8:1:2"]
)
def test_what_is_no_address_is_refused_with_the_form(text: str) -> None:
    with pytest.raises(InvalidOptionError, match=r"is no address of a router\. Write tcp/HOST:PORT") as refused:
        require_address(text, "router")
    assert refused.value.option == "router"
