"""The same for asyncio: ``async with lexican.aio.Machine("machine.toml") as machine: await machine.node("feeder").read("6064")``.

Each object is one of :mod:`lexican`, which is its ``blocking``, and may be used beside it: calls wait in threads, where they hold no
lock of the interpreter. A call to a drive that is cancelled stops the drive, and ends once it stands.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine, Sequence
from functools import wraps
from os import PathLike
from types import TracebackType
from typing import Any, Concatenate, ParamSpec, TypeVar

import lexican
from lexican import DriveError, Event

P = ParamSpec("P")
T = TypeVar("T")
Path = str | PathLike[str]


def _awaited(method: Callable[Concatenate[Any, P], T]) -> Callable[Concatenate[Any, P], Coroutine[Any, Any, T]]:
    """The same method, of what an object is over."""

    @wraps(method)
    async def call(self: _Over, /, *arguments: P.args, **named: P.kwargs) -> T:
        return await self._call(method, self.blocking, *arguments, **named)  # pyright: ignore[reportPrivateUsage]

    return call


class _Over:
    """An object over one that blocks."""

    def __init__(self, blocking: Any) -> None:
        self._blocking = blocking

    @property
    def blocking(self) -> Any:
        """What it is the same as."""
        return self._blocking

    async def _call(self, call: Callable[..., T], *arguments: Any, **named: Any) -> T:
        return await asyncio.to_thread(call, *arguments, **named)

    async def close(self) -> None:
        """As that of what it is over."""
        await asyncio.to_thread(self.blocking.close)

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()


class Network(_Over):
    """As :class:`lexican.Network`, or over one."""

    def __init__(self, bus: Any) -> None:
        super().__init__(bus if isinstance(bus, lexican.Network) else lexican.Network(bus))

    @property
    def blocking(self) -> lexican.Network:
        """What it is the same as."""
        network: lexican.Network = self._blocking
        return network

    def add_node(self, id: int, sheet: Path | lexican.DataSheet, overlays: Sequence[Path] = (), name: str | None = None) -> Node:
        """As :meth:`lexican.Network.add_node`, at once."""
        return Node(self.blocking.add_node(id, sheet, overlays, name))

    def node(self, name_or_id: str | int) -> Node:
        """As :meth:`lexican.Network.node`, at once."""
        return Node(self.blocking.node(name_or_id))

    def nodes(self) -> list[Node]:
        """As :meth:`lexican.Network.nodes`, at once."""
        return [Node(node) for node in self.blocking.nodes()]

    scan = _awaited(lexican.Network.scan)
    read_bytes = _awaited(lexican.Network.read_bytes)
    write_bytes = _awaited(lexican.Network.write_bytes)
    nmt = _awaited(lexican.Network.nmt)
    send = _awaited(lexican.Network.send)
    produce_sync = _awaited(lexican.Network.produce_sync)
    produce_heartbeat = _awaited(lexican.Network.produce_heartbeat)
    watch_heartbeat = _awaited(lexican.Network.watch_heartbeat)
    sleep = _awaited(lexican.Network.sleep)
    now = _awaited(lexican.Network.now)

    async def events(self) -> AsyncIterator[Event]:
        """What happens to the nodes that have names, from now on."""
        events = self.blocking.events()
        while True:
            # For so short a time that a loop that ends waits for no thread.
            event = await self._call(events.next, 0.2)
            if event is not None:
                yield event

    async def __aenter__(self) -> Network:
        return self


class Machine(Network):
    """As :class:`lexican.Machine`, or over one, such as that of :func:`lexican.simulate`."""

    def __init__(self, path: Path | lexican.Machine) -> None:
        super().__init__(path if isinstance(path, lexican.Machine) else lexican.Machine(path))

    @property
    def blocking(self) -> lexican.Machine:
        """What it is the same as."""
        machine: lexican.Machine = self._blocking
        return machine

    boot = _awaited(lexican.Machine.boot)
    backup = _awaited(lexican.Machine.backup)
    restore = _awaited(lexican.Machine.restore)

    async def __aenter__(self) -> Machine:
        return self


class Node(_Over):
    """As :class:`lexican.Node`."""

    read = _awaited(lexican.Node.read)
    read_all = _awaited(lexican.Node.read_all)
    write = _awaited(lexican.Node.write)
    backup = _awaited(lexican.Node.backup)
    restore = _awaited(lexican.Node.restore)

    async def drive(self) -> Drive:
        """As :meth:`lexican.Node.drive`."""
        return Drive(await self._call(self.blocking.drive))

    async def pdos(self) -> list[Pdo]:
        """As :meth:`lexican.Node.pdos`."""
        return [Pdo(pdo) for pdo in await self._call(self.blocking.pdos)]


class Pdo(_Over):
    """As :class:`lexican.Pdo`."""

    latest = _awaited(lexican.Pdo.latest)
    next = _awaited(lexican.Pdo.next)
    decode = _awaited(lexican.Pdo.decode)


class Drive(_Over):
    """As :class:`lexican.Drive`."""

    async def _call(self, call: Callable[..., T], *arguments: Any, **named: Any) -> T:
        done = asyncio.ensure_future(super()._call(call, *arguments, **named))
        try:
            return await asyncio.shield(done)
        except asyncio.CancelledError:
            self.blocking.cancel()
            try:
                await done
            except DriveError:
                pass  # It says that the drive was stopped.
            raise

    state = _awaited(lexican.Drive.state)
    position = _awaited(lexican.Drive.position)
    velocity = _awaited(lexican.Drive.velocity)
    enable = _awaited(lexican.Drive.enable)
    disable = _awaited(lexican.Drive.disable)
    reset_fault = _awaited(lexican.Drive.reset_fault)
    move_to = _awaited(lexican.Drive.move_to)
    start_moving_to = _awaited(lexican.Drive.start_moving_to)
    finish = _awaited(lexican.Drive.finish)
    run_at = _awaited(lexican.Drive.run_at)
    home = _awaited(lexican.Drive.home)
    stop = _awaited(lexican.Drive.stop)
    quick_stop = _awaited(lexican.Drive.quick_stop)
    resume = _awaited(lexican.Drive.resume)

    async def __aenter__(self) -> Drive:
        return self
