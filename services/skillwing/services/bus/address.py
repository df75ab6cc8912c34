"""Addresses of routers."""

from __future__ import annotations

import re

FORM = "tcp/HOST:PORT, or with keys tls/HOST:PORT"
"""Form of an address, for messages."""
_ADDRESS = re.compile(r"(tcp|tls)/([^/:]+|\[[^\]/]+\]):(?P<port>[0-9]{1,5})([#?].+)?")
_LAST_PORT = 65535


def is_address(text: str) -> bool:
    """True for `tcp/HOST:PORT` or `tls/HOST:PORT`, with a port up to 65535; `#iface=eth0` may follow."""
    found = _ADDRESS.fullmatch(text)
    return found is not None and int(found["port"]) <= _LAST_PORT
