"""The network thread of an asyncio client."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable
from typing import TypeVar, TypeVarTuple, Unpack

from skillwing.services.bus import RunnableBus
from skillwing.services.client.interface import SkillsetInterface

T = TypeVar("T")
A = TypeVarTuple("A")


class NetworkThread:
    """Thread of a connection, for use by the event loop."""

    def __init__(self) -> None:
        loop = asyncio.get_running_loop()
        self._loop = loop
        self._opened: asyncio.Future[tuple[RunnableBus, SkillsetInterface]] = loop.create_future()
        self.ended: asyncio.Future[None] = loop.create_future()
        self._bus: RunnableBus | None = None
        self._stopping = False

    async def start(self, live: Callable[[], None]) -> tuple[RunnableBus, SkillsetInterface]:
        """Run `live`, which has to call `serve`, on the thread. Raises the exceptions of `live` before `serve`."""

        def run() -> None:
            try:
                live()
            except Exception as error:  # noqa: BLE001 - it is raised in the event loop
                self._post(self._fail, error)
            else:
                self._post(self._settle, self.ended, None)

        threading.Thread(target=run, name="skillwing network", daemon=True).start()
        return await self._opened

    def serve(self, bus: RunnableBus, interface: SkillsetInterface) -> None:
        """Run the bus until `stop`. Call it on the network thread."""
        self._bus = bus
        self._post(self._settle, self._opened, (bus, interface))
        bus.run_until(lambda: self._stopping)

    async def stop(self) -> None:
        """Close the connection; returns when the thread has closed it."""
        self._stopping = True
        if self._bus is not None:
            self._bus.post(_nothing)
            await self.ended

    def _post(self, action: Callable[[Unpack[A]], None], *arguments: *A) -> None:
        with contextlib.suppress(RuntimeError):  # the loop is closed
            self._loop.call_soon_threadsafe(action, *arguments)

    def _settle(self, future: asyncio.Future[T], result: T) -> None:
        if not future.done():
            future.set_result(result)

    def _fail(self, error: Exception) -> None:
        future = self.ended if self._opened.done() else self._opened
        if not future.done():
            future.set_exception(error)


def _nothing() -> None:
    pass
