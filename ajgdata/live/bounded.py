"""What a client sends, as far as it is heard out."""

from __future__ import annotations

import io
import socket
import time
from typing import Any


class BoundedReader(io.RawIOBase):
    """Reads so many bytes of a connection, for so long altogether; OSError beyond.

    A limit for each read alone would let a client send a byte now and then for ever. The
    connection's own timeout, which holds for what is sent to it, is as before after each read.
    """

    def __init__(self, connection: socket.socket, most: int, timeout_s: float) -> None:
        super().__init__()
        self._connection, self._left = connection, most
        self._until = time.monotonic() + timeout_s

    def readable(self) -> bool:
        """Return True: it is there to be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Read into `buffer` what has come, at least a byte; return how many, 0 at the end."""
        left_s = self._until - time.monotonic()
        if left_s <= 0:
            raise TimeoutError("the request takes too long")
        if not self._left:
            raise OSError("the request is too long")
        before = self._connection.gettimeout()
        self._connection.settimeout(left_s)
        try:
            count = self._connection.recv_into(memoryview(buffer)[: self._left])
        finally:
            self._connection.settimeout(before)
        self._left -= count
        return count
