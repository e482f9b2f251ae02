"""The buses of lexican as an interface of python-can: ``can.Bus(interface="lexican", channel="sim:siko/ag03-1?node=5")``.

A channel is a URL as the command has it, or a network that is simulated with ``pace="real"``: then programs for python-can,
such as those with python-canopen, and those with lexican share its devices.
"""

from __future__ import annotations

from typing import Any

from can import BusABC, CanInitializationError, CanOperationError, CanProtocol, Message

from lexican import LexicanError, Network
from lexican._native import Frames

__all__ = ["LexicanBus"]


def _fields(msg: Message) -> tuple[int, bool, bytes, int | None]:
    """A message as frames are sent here."""
    return msg.arbitration_id, msg.is_extended_id, bytes(msg.data), msg.dlc if msg.is_remote_frame else None


def receive(bus: BusABC) -> tuple[int, bool, bytes, int | None] | None:
    """The next frame of classic CAN from a bus of python-can, for a network that is over it."""
    msg = bus.recv(0.05)
    return None if msg is None or msg.is_error_frame or msg.is_fd else _fields(msg)


def send(bus: BusABC, id: int, extended: bool, remote: bool, length: int, data: bytes) -> None:
    """Sends a frame to a bus of python-can, for a network that is over it."""
    bus.send(Message(arbitration_id=id, is_extended_id=extended, is_remote_frame=remote, dlc=length, data=data))


class LexicanBus(BusABC):
    """A bus of lexican, as python-can makes it. All other arguments are python-can's."""

    def __init__(self, channel: str | Network, can_filters: Any = None, **kwargs: Any) -> None:
        try:
            self._frames = Frames(channel) if isinstance(channel, str) else channel.frames()
        except LexicanError as error:
            raise CanInitializationError(str(error)) from error
        self.channel_info = f"lexican {channel}"
        self._can_protocol = CanProtocol.CAN_20
        super().__init__(str(channel), can_filters, **kwargs)

    def send(self, msg: Message, timeout: float | None = None) -> None:
        """Sends a frame; there is room for any number of them."""
        if msg.is_fd or msg.is_error_frame:
            raise CanOperationError("CANopen has neither CAN FD nor error frames")
        try:
            self._frames.send(*_fields(msg))
        except LexicanError as error:
            raise CanOperationError(str(error)) from error

    def _recv_internal(self, timeout: float | None) -> tuple[Message | None, bool]:
        try:
            received = self._frames.receive(timeout)
        except LexicanError as error:
            raise CanOperationError(str(error)) from error
        if received is None:
            return None, False
        timestamp, arbitration_id, extended, remote, length, data = received
        message = Message(
            timestamp=timestamp,
            arbitration_id=arbitration_id,
            is_extended_id=extended,
            is_remote_frame=remote,
            dlc=length,
            data=None if remote else data,
            channel=self.channel_info,
        )
        return message, False

    def shutdown(self) -> None:
        """Lets the bus go."""
        super().shutdown()
        self._frames.close()
