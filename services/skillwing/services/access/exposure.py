"""Exposure of a router: who can reach its address, and what protects it."""

from __future__ import annotations

from ipaddress import ip_address
from pathlib import Path

from skillwing.services.bus.address import FORM, is_address
from skillwing.services.errors import InvalidOptionError

EVERY_ADDRESS = {"0.0.0.0": "127.0.0.1", "::": "::1"}
"""Addresses for all interfaces, each with the one at which the machine itself connects."""


def require_address(endpoint: str, option: str, form: str = FORM) -> None:
    """Raise InvalidOptionError for a malformed address. option: the option or variable that has it."""
    if not is_address(endpoint):
        what = f"`{endpoint}`, given by `{option}`, is no address of a router."
        raise InvalidOptionError(option, f"{what} Write {form}, with a port up to 65535.")


def host_of(endpoint: str) -> str:
    """The host in `tcp/HOST:PORT`, without the brackets of an IPv6 address."""
    return endpoint.partition("/")[2].rpartition(":")[0].strip("[]")


def is_loopback(endpoint: str) -> bool:
    """True for an address that no other machine can reach."""
    host = host_of(endpoint)
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def local_endpoint(endpoint: str) -> str:
    """The address at which processes of the same machine find a router that listens at `endpoint`."""
    host = host_of(endpoint)
    return endpoint.replace(host, EVERY_ADDRESS[host], 1) if host in EVERY_ADDRESS else endpoint


def require_protected(listen: str, keys: Path | None, *, insecure: bool) -> None:
    """Raise InvalidOptionError for an address that strangers can reach without keys, unless `insecure`.

    The same for a malformed address.
    """
    require_address(listen, "listen")
    if not listen.rpartition(":")[2].isdecimal():
        raise InvalidOptionError("listen", f"A router cannot listen at {listen}. Write {FORM}, with nothing behind it.")
    tls = listen.startswith("tls/")
    if keys is not None and not tls:
        text = f"With --keys the router listens at tls/HOST:PORT, not at {listen}. Write --listen tls/HOST:PORT."
        raise InvalidOptionError("listen", text)
    if tls and keys is None:
        text = (
            f"The address {listen} needs keys. Make some with `skillwing keys init`, and give their folder by --keys."
        )
        raise InvalidOptionError("keys", text)
    if keys is None and not insecure and not is_loopback(listen):
        text = f"Everybody who reaches {listen} could command the robot. Give --keys DIR (docs/keys.md), or --insecure."
        raise InvalidOptionError("listen", text)


EXPOSED = "Everybody who reaches {endpoint} can read and command the robot: it listens without keys (--insecure)."
"""Warning about a router without keys that strangers can reach."""


def exposed(endpoint: str) -> bool:
    """True for a router without keys that strangers can reach."""
    return not endpoint.startswith("tls/") and not is_loopback(endpoint)
