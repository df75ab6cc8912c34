"""Certificates as plain data, apart from the library that reads and signs them.

Every process of a robot imports this module. Without keys none needs the library, whose import takes 30 ms.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

ROUTER_NAME = "router"


@dataclass(frozen=True, slots=True)
class Issued:
    """A certificate and its private key, both as PEM."""

    certificate: bytes
    key: bytes


@dataclass(frozen=True, slots=True)
class CertificateFacts:
    """Content of a certificate. name: common name. role: organizational unit, empty for none. expires: UTC."""

    name: str
    role: str
    expires: datetime
    hosts: tuple[str, ...] = ()


def utc_now() -> datetime:
    """The present time."""
    return datetime.now(UTC)
