"""The keys of a router: its certificate, the rules of its site, and the names that it confirms."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from skillwing.services.access.identity_files import read_identity, remake
from skillwing.services.access.key_store import KeyStore
from skillwing.services.access.policy import SiteAccess, role_at
from skillwing.services.access.zenoh_rules import access_control
from skillwing.services.bus.identity import SessionIdentity


@dataclass(frozen=True, slots=True)
class RouterKeys:
    """identity: the router's own. rules: `access_control` in the configuration of Zenoh. site: who may do what."""

    identity: SessionIdentity
    rules: Mapping[str, Any]
    site: SiteAccess

    def role(self, robot: str, name: str) -> str:
        """Role in a robot of the holder of a certificate; empty for a name without rights there."""
        return str(role_at(self.site, robot, name) or "")


def read_router_keys(folder: Path) -> RouterKeys:
    """The keys of the router in the folder of a site (`KeyStore`). Raises KeysError."""
    store = KeyStore(folder)
    site = store.site()
    rules = access_control(site)
    return RouterKeys(read_identity(store.router_folder, lambda: remake(folder)), rules, site)
