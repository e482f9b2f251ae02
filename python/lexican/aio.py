"""The same for asyncio: ``async with lexican.aio.Machine("machine.toml") as machine: await machine.node("feeder").read("6064")``.

Each object is one of :mod:`lexican`, which is its ``blocking``, and may be used beside it: calls wait in threads, where they hold no
lock of the interpreter. A call to a drive that is cancelled stops the drive, and ends once it stands.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Sequence
from os import PathLike
from types import TracebackType
from typing import TYPE_CHECKING, Any, TypeVar

import lexican
from lexican import DriveError, Event, Outcome, Value

if TYPE_CHECKING:
    from lexican._native import NmtCommand

T = TypeVar("T")
Path = str | PathLike[str]
ObjectName = str | int | tuple[int, int]

_call = asyncio.to_thread


class Network:
    """As :class:`lexican.Network`, or over one."""

    def __init__(self, bus: Any) -> None:
        self._network: lexican.Network = bus if isinstance(bus, lexican.Network) else lexican.Network(bus)

    @property
    def blocking(self) -> lexican.Network:
        """What it is the same as."""
        return self._network

    def add_node(self, id: int, sheet: Path | lexican.DataSheet, overlays: Sequence[Path] = (), name: str | None = None) -> Node:
        """As :meth:`lexican.Network.add_node`, at once."""
        return Node(self.blocking.add_node(id, sheet, overlays, name))

    def node(self, name_or_id: str | int) -> Node:
        """As :meth:`lexican.Network.node`, at once."""
        return Node(self.blocking.node(name_or_id))

    async def scan(self, timeout: float = 0.5) -> list[int]:
        """As :meth:`lexican.Network.scan`."""
        return await _call(self.blocking.scan, timeout)

    async def read_bytes(self, node: int, index: int, sub: int = 0) -> bytes:
        """As :meth:`lexican.Network.read_bytes`."""
        return await _call(self.blocking.read_bytes, node, index, sub)

    async def write_bytes(self, node: int, index: int, sub: int, data: bytes) -> None:
        """As :meth:`lexican.Network.write_bytes`."""
        await _call(self.blocking.write_bytes, node, index, sub, data)

    async def nmt(self, command: NmtCommand, node: int | None = None) -> None:
        """As :meth:`lexican.Network.nmt`."""
        await _call(self.blocking.nmt, command, node)

    async def send(self, cob_id: int, data: bytes = b"") -> None:
        """As :meth:`lexican.Network.send`."""
        await _call(self.blocking.send, cob_id, data)

    async def sleep(self, span: float) -> None:
        """As :meth:`lexican.Network.sleep`."""
        await _call(self.blocking.sleep, span)

    async def events(self) -> AsyncIterator[Event]:
        """What happens to the nodes that have names, from now on."""
        events = self.blocking.events()
        while True:
            # For so short a time that a loop that ends waits for no thread.
            event = await _call(events.next, 0.2)
            if event is not None:
                yield event

    async def close(self) -> None:
        """As :meth:`lexican.Network.close`."""
        await _call(self.blocking.close)

    async def __aenter__(self) -> Network:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()


class Machine(Network):
    """As :class:`lexican.Machine`, or over one, such as that of :func:`lexican.simulate`."""

    def __init__(self, path: Path | lexican.Machine) -> None:
        self._machine = path if isinstance(path, lexican.Machine) else lexican.Machine(path)
        super().__init__(self._machine)

    @property
    def blocking(self) -> lexican.Machine:
        """What it is the same as."""
        return self._machine

    async def boot(self) -> None:
        """As :meth:`lexican.Machine.boot`."""
        await _call(self.blocking.boot)

    async def __aenter__(self) -> Machine:
        return self


class Node:
    """As :class:`lexican.Node`."""

    def __init__(self, blocking: lexican.Node) -> None:
        self.blocking = blocking

    async def read(self, object: ObjectName) -> Value:
        """As :meth:`lexican.Node.read`."""
        return await _call(self.blocking.read, object)

    async def read_all(self, object: ObjectName) -> list[Value]:
        """As :meth:`lexican.Node.read_all`."""
        return await _call(self.blocking.read_all, object)

    async def write(self, object: ObjectName, value: bool | int | float | str | bytes) -> None:
        """As :meth:`lexican.Node.write`."""
        await _call(self.blocking.write, object, value)

    async def drive(self) -> Drive:
        """As :meth:`lexican.Node.drive`."""
        return Drive(await _call(self.blocking.drive))


class Drive:
    """As :class:`lexican.Drive`."""

    def __init__(self, blocking: lexican.Drive) -> None:
        self.blocking = blocking

    async def _call(self, call: Callable[..., T], *arguments: Any) -> T:
        done = asyncio.ensure_future(_call(call, *arguments))
        try:
            return await asyncio.shield(done)
        except asyncio.CancelledError:
            self.blocking.cancel()
            try:
                await done
            except DriveError:
                pass  # It says that the drive was stopped.
            raise

    async def state(self) -> str:
        """As :meth:`lexican.Drive.state`."""
        return await self._call(self.blocking.state)

    async def position(self) -> int:
        """As :meth:`lexican.Drive.position`."""
        return await self._call(self.blocking.position)

    async def velocity(self) -> int:
        """As :meth:`lexican.Drive.velocity`."""
        return await self._call(self.blocking.velocity)

    async def enable(self) -> Outcome:
        """As :meth:`lexican.Drive.enable`."""
        return await self._call(self.blocking.enable)

    async def disable(self) -> Outcome:
        """As :meth:`lexican.Drive.disable`."""
        return await self._call(self.blocking.disable)

    async def reset_fault(self) -> Outcome:
        """As :meth:`lexican.Drive.reset_fault`."""
        return await self._call(self.blocking.reset_fault)

    async def move_to(self, position: str | float) -> Outcome:
        """As :meth:`lexican.Drive.move_to`."""
        return await self._call(self.blocking.move_to, position)

    async def start_moving_to(self, position: str | float) -> None:
        """As :meth:`lexican.Drive.start_moving_to`."""
        await self._call(self.blocking.start_moving_to, position)

    async def finish(self) -> Outcome:
        """As :meth:`lexican.Drive.finish`."""
        return await self._call(self.blocking.finish)

    async def run_at(self, velocity: str | float, lasting: float) -> Outcome:
        """As :meth:`lexican.Drive.run_at`."""
        return await self._call(self.blocking.run_at, velocity, lasting)

    async def home(self, method: int | None = None) -> Outcome:
        """As :meth:`lexican.Drive.home`."""
        return await self._call(self.blocking.home, method)

    async def stop(self) -> Outcome:
        """As :meth:`lexican.Drive.stop`."""
        return await self._call(self.blocking.stop)

    async def quick_stop(self) -> Outcome:
        """As :meth:`lexican.Drive.quick_stop`."""
        return await self._call(self.blocking.quick_stop)

    async def resume(self) -> Outcome:
        """As :meth:`lexican.Drive.resume`."""
        return await self._call(self.blocking.resume)

    async def close(self) -> None:
        """As :meth:`lexican.Drive.close`."""
        await _call(self.blocking.close)

    async def __aenter__(self) -> Drive:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.close()
