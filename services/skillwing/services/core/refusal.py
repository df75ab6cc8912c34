"""`RefusedError`: a request that a core rejects."""

from __future__ import annotations

from collections.abc import Iterable

from skillwing.services.protocol import ErrorCode, ErrorReply


class RefusedError(Exception):
    """A request that was refused and has changed nothing.

    code: kind of the refusal; message: one sentence about what is wrong; help: one sentence about what to do; known:
    the accepted names, if a name was the problem.
    """

    def __init__(self, code: ErrorCode, message: str, *, help: str = "", known: Iterable[str] = ()) -> None:
        super().__init__(f"{message} {help}".strip())
        self.code = code
        self.message = message
        self.help = help
        self.known = tuple(known)

    @property
    def reply(self) -> ErrorReply:
        """The refusal as it goes over the wire."""
        return ErrorReply(code=self.code, message=self.message, help=self.help, known=self.known)
