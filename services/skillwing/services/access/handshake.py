"""Reasons for which a router with keys does not let a certificate in. Zenoh itself reports none."""

from __future__ import annotations

import contextlib
import socket

from skillwing.services.access.certificate_facts import utc_now
from skillwing.services.access.exposure import host_of
from skillwing.services.access.key_store import read_facts
from skillwing.services.bus.identity import SessionIdentity
from skillwing.services.bus.zenoh_session import RouterUnreachableError
from skillwing.services.errors import NotKnownError, SkillwingError

CONNECT_TIMEOUT = 0.5
"""Seconds for a connection. Zenoh has tried for longer before, so a router that is there answers soon."""
TIMEOUT = 2.0
"""Seconds for the router's objection to a certificate."""
OTHER_AUTHORITY = "your certificate comes from another authority than the router's"
REMOVED = "the router does not know your name, or no longer. It reads the names when it starts"
RESTART = "If your keys are new, restart the router (docs/keys.md). Else ask the owner of the robot for new keys."
_ALERTS = {
    "CERTIFICATE_EXPIRED": "your certificate has expired",
    "UNKNOWN_CA": OTHER_AUTHORITY,
    "DECRYPT_ERROR": OTHER_AUTHORITY,
    "BAD_CERTIFICATE": OTHER_AUTHORITY,
    "CERTIFICATE_UNKNOWN": OTHER_AUTHORITY,
    "HANDSHAKE_FAILURE": OTHER_AUTHORITY,
    "CERTIFICATE_REQUIRED": "the router asks for a certificate",
}
"""Sentences for TLS alerts."""


def unknown_name(endpoint: str) -> NotKnownError:
    """The error for a name that the router does not know, so that it may have been added or removed since its start."""
    return NotKnownError(endpoint, REMOVED, RESTART)


def explained(error: RouterUnreachableError, identity: SessionIdentity | None) -> SkillwingError:
    """The error, or NotKnownError with the reason if a router is there and rejects the certificate, or is not ours."""
    reason = None if identity is None else _objection(error.endpoint, identity)
    return error if reason is None else NotKnownError(error.endpoint, reason)


def _objection(endpoint: str, identity: SessionIdentity) -> str | None:
    """The reason against a certificate; None for a router that is not there, or that accepts it."""
    expires = read_facts(identity.folder).expires
    if expires <= utc_now():
        return f"your certificate `{identity.name}` expired on {expires:%Y-%m-%d}"
    host, port = host_of(endpoint), endpoint.rpartition(":")[2]
    try:
        connection = socket.create_connection((host, int(port)), CONNECT_TIMEOUT)
    except (OSError, ValueError):
        return None
    with connection:
        connection.settimeout(TIMEOUT)
        return _handshake(connection, host, identity)


def _handshake(connection: socket.socket, host: str, identity: SessionIdentity) -> str | None:
    import ssl  # noqa: PLC0415 - needed after an error only

    try:
        context = ssl.create_default_context(cafile=str(identity.authority))
        context.load_cert_chain(identity.certificate, identity.key)
        with context.wrap_socket(connection, server_hostname=host) as link, contextlib.suppress(TimeoutError):
            # A router that objects to a certificate says so after the handshake. One that does not waits for Zenoh.
            link.recv(1)
    except ssl.SSLCertVerificationError as error:
        return f"the router's certificate is not trusted ({error.verify_message.rstrip('.')})"
    except (ssl.SSLEOFError, ssl.SSLZeroReturnError):  # a tunnel or proxy that has no router behind it
        return None
    except ssl.SSLError as error:
        alert = next((text for word, text in _ALERTS.items() if word in (error.reason or "")), None)
        return alert or f"no TLS is spoken there ({error.reason})"
    except OSError:
        return None
    return None
