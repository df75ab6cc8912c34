"""Messages of a Rerun recording in a stream of bytes. Pure.

A recording is a header of 12 bytes, then messages. Each begins with its kind and its length, 8 bytes each, little
endian. The message of kind 0 ends the recording. In files with an index, the index follows it.
"""

from __future__ import annotations

import struct

HEADER_BYTES = 12
_HEAD = struct.Struct("<QQ")
_END = 0


class RrdMessages:
    """Splits a stream into its header and its messages. An incomplete message waits for the rest of it."""

    def __init__(self) -> None:
        self._rest = bytearray()
        self._begun = False
        self._ended = False

    def feed(self, data: bytes) -> list[bytes]:
        """The messages that are whole now. Bytes after the end are handed on as they come."""
        self._rest += data
        found: list[bytes] = []
        while (length := self._length()) and length <= len(self._rest):
            content = bytes(self._rest[:length])
            del self._rest[:length]
            self._ended = self._ended or (self._begun and _HEAD.unpack_from(content)[0] == _END)
            self._begun = True
            found.append(content)
        return found

    def _length(self) -> int:
        """Bytes of what comes next; 0 if that is unknown yet."""
        if not self._begun:
            return HEADER_BYTES
        if self._ended:
            return len(self._rest)
        if len(self._rest) < _HEAD.size:
            return 0
        return _HEAD.size + _HEAD.unpack_from(self._rest)[1]
