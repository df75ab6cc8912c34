"""Reasons for which a router does not let a session in. Zenoh itself reports none."""

from __future__ import annotations

import contextlib
import socket

from skillwing.services.access.certificate_facts import utc_now
from skillwing.services.access.exposure import host_of
from skillwing.services.access.key_store import read_facts
from skillwing.services.bus.identity import SessionIdentity
from skillwing.services.bus.zenoh_session import RouterUnreachableError, open_client
from skillwing.services.errors import InvalidOptionError, KeysError, NotKnownError, SkillwingError

CONNECT_TIMEOUT = 0.5
"""Seconds for a connection. Zenoh has tried for longer before, so a router that is there answers soon."""
HANDSHAKE_TIMEOUT = 1.5
"""Seconds for the handshake: two answers."""
TIMEOUT = 2.0
"""Seconds for the router's objection to a certificate."""
PLAIN_TIMEOUT = 0.2
"""Seconds for a connection, and for a handshake, where no keys are expected. A slow answer costs the hint only."""
OTHER_AUTHORITY = "your certificate comes from another authority than the router's"
REMOVED = "the router does not know your name, or no longer. It reads the names when it starts"
NO_ANSWER = "nobody answers the handshake"
"""Behaviour of a router without keys, of one that is frozen, and of a tunnel that has no router behind it."""
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
    """The error, or what is known better of a router that is there.

    NotKnownError with the reason if it rejects the certificate, or is not ours. InvalidOptionError if keys are used at
    one end only.
    """
    endpoint = error.endpoint
    address = endpoint.partition("/")[2]
    if identity is None:
        if not _speaks_tls(endpoint):
            return error
        text = f"What listens at {endpoint} speaks TLS, as a router with keys does."
        return InvalidOptionError("endpoint", f"{text} Write tls/{address}, with the folder of your keys.")
    reason = _objection(endpoint, identity)
    if reason is None:
        return error
    if reason == NO_ANSWER and _is_plain(address):
        text = f"The router at {endpoint} has no keys, so anybody may have started it."
        return InvalidOptionError("endpoint", f"{text} Ask its owner, or write tcp/{address} if you mean that one.")
    return error if reason == NO_ANSWER else NotKnownError(endpoint, reason)


def _connection(endpoint: str, timeout: float) -> socket.socket | None:
    """A connection to an address; None if nothing listens there."""
    host, port = host_of(endpoint), endpoint.partition("#")[0].rpartition(":")[2]
    try:
        return socket.create_connection((host, int(port)), timeout)
    except (OSError, ValueError):
        return None


def _is_plain(address: str) -> bool:
    """True for the `HOST:PORT` of a router without keys."""
    with contextlib.suppress(RouterUnreachableError):
        open_client(f"tcp/{address}", None, CONNECT_TIMEOUT).close()
        return True
    return False


def _speaks_tls(endpoint: str) -> bool:
    """True for an address at which somebody speaks TLS."""
    import ssl  # noqa: PLC0415 - needed after an error only

    connection = _connection(endpoint, PLAIN_TIMEOUT)
    if connection is None:
        return False
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # no message follows
    with connection:
        try:
            context.wrap_socket(connection).close()
        except ssl.SSLError as error:
            return "ALERT" in (error.reason or "")
        except OSError:
            return False
    return True


def _objection(endpoint: str, identity: SessionIdentity) -> str | None:
    """The reason against a certificate; None for a router that is not there, or that accepts it."""
    try:
        expires = read_facts(identity.folder).expires
    except KeysError:  # taken away a moment ago
        return None
    if expires <= utc_now():
        return f"your certificate `{identity.name}` expired on {expires:%Y-%m-%d}"
    connection = _connection(endpoint, CONNECT_TIMEOUT)
    if connection is None:
        return None
    with connection:
        connection.settimeout(HANDSHAKE_TIMEOUT)
        return _handshake(connection, host_of(endpoint), identity)


def _handshake(connection: socket.socket, host: str, identity: SessionIdentity) -> str | None:
    import ssl  # noqa: PLC0415 - needed after an error only

    try:
        context = ssl.create_default_context(cafile=str(identity.authority))
        context.load_cert_chain(identity.certificate, identity.key)
    except OSError:  # the files were whole when the identity was made, and have changed since
        return None
    try:
        with context.wrap_socket(connection, server_hostname=host) as link, contextlib.suppress(TimeoutError):
            link.settimeout(TIMEOUT)
            # A router that objects to a certificate says so after the handshake. One that does not waits for Zenoh.
            link.recv(1)
    except ssl.SSLCertVerificationError as error:
        return f"the router's certificate is not trusted ({error.verify_message.rstrip('.')})"
    except (ssl.SSLEOFError, ssl.SSLZeroReturnError, ConnectionResetError, TimeoutError):
        return NO_ANSWER
    except ssl.SSLError as error:
        alert = next((text for word, text in _ALERTS.items() if word in (error.reason or "")), None)
        return alert or f"no TLS is spoken there ({error.reason})"
    except OSError:
        return None
    return None
