"""Identity of a session: the certificate that it shows, and the name that is bound to its questions.

The receiver of a Zenoh query does not learn the sender's certificate. A sender with an identity therefore asks at
`KEY/by/NAME`, which the router allows only to the holder of the certificate of that name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from skillwing.services.names import SEPARATOR
from skillwing.services.protocol import ErrorReply

KEYS_VARIABLE = "SKILLWING_KEYS"
"""Environment variable with the folder of keys of a person, a process or a router."""
BY = "by"
WHO = "access"
"""Begin of the key at which a router confirms a name that it knows, and says its role: `access/NAME`."""
CERTIFICATE_FILE, KEY_FILE, AUTHORITY_FILE = "certificate.pem", "key.pem", "authority.pem"


def no_denial(role: str, key: str) -> ErrorReply | None:
    """No reason against a question, whatever the role."""
    del role, key
    return None


@dataclass(frozen=True, slots=True)
class SessionIdentity:
    """A certificate with its key.

    name: common name of the certificate, one chunk of a key. folder: directory with the three files in PEM format.
    refusal: the certificate's reason against a question at a key relative to the robot's namespace, None for none.
    denial: the same for a role that the router says. A session with it asks the router after silence.
    """

    name: str
    folder: Path
    refusal: Callable[[str], ErrorReply | None] = lambda _: None
    denial: Callable[[str, str], ErrorReply | None] = no_denial

    def in_role(self, role: str) -> SessionIdentity:
        """The same identity, refused by a role that the router has said; empty for one that it has not."""
        return replace(self, refusal=lambda key: self.denial(role, key)) if role else self

    @property
    def certificate(self) -> Path:
        """The certificate."""
        return self.folder / CERTIFICATE_FILE

    @property
    def key(self) -> Path:
        """The private key."""
        return self.folder / KEY_FILE

    @property
    def authority(self) -> Path:
        """The certificate of the authority that issued it."""
        return self.folder / AUTHORITY_FILE

    def connecting(self) -> dict[str, Any]:
        """Zenoh's settings of TLS for a session that connects to a router."""
        return {
            "root_ca_certificate": str(self.authority),
            "enable_mtls": True,
            "connect_certificate": str(self.certificate),
            "connect_private_key": str(self.key),
            "verify_name_on_connect": True,
        }

    def listening(self) -> dict[str, Any]:
        """Zenoh's settings of TLS for a router."""
        return {
            "root_ca_certificate": str(self.authority),
            "enable_mtls": True,
            "listen_certificate": str(self.certificate),
            "listen_private_key": str(self.key),
            "close_link_on_expiration": True,
        }


def signed(key: str, name: str) -> str:
    """The key at which a sender of that name asks."""
    return f"{key}/{BY}/{name}"


def split_asker(key: str) -> tuple[str, str | None]:
    """A key and the name of its sender; None without a name."""
    head, mark, name = key.rpartition(f"/{BY}/")
    return (head, name) if mark else (key, None)


def owned_chunk(name: str, rest: str) -> str:
    """A chunk of a key that belongs to the holder of a name, such as that of an owner's token."""
    return f"{name}{SEPARATOR}{rest}"


def needs_identity(endpoint: str) -> bool:
    """True for the address of a router that asks for a certificate."""
    return endpoint.startswith("tls/")
