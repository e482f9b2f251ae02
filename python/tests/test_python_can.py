"""python-can in both directions, with python-canopen on the other side."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import canopen
import lexican
import pytest


@pytest.fixture
def manager(sensor: Path) -> Iterator[tuple[Any, lexican.Machine]]:
    """python-canopen's manager on the bus of a simulated sensor."""
    with lexican.simulate(sensor, node=7, pace="real") as simulated:
        network: Any = canopen.Network()
        network.connect(interface="lexican", channel=simulated)
        yield network, simulated
        network.disconnect()


def test_python_canopen_manages_our_device(manager: tuple[Any, lexican.Machine], sensor: Path) -> None:
    network, simulated = manager
    node = network.add_node(7, str(sensor))
    assert node.sdo["Pressure"].raw == -7
    assert node.sdo["Identity object"]["Vendor-ID"].raw == 0x123
    node.sdo["Producer heartbeat time"].raw = 50
    assert node.nmt.wait_for_heartbeat(timeout=5) == "PRE-OPERATIONAL"
    with pytest.raises(canopen.SdoAbortedError) as aborted:
        node.sdo["Pressure"].raw = 1
    assert aborted.value.code == 0x0601_0002
    simulated.carry_out("node7", "set 2000 -300")
    assert node.sdo["Pressure"].raw == -300
    # A device answers on one channel, so that one client hears the answers to another one.
    simulated.sleep(0.1)
    assert simulated[7].read("pressure").value == -300, "both have the same device"


def test_blocks_are_exchanged_with_python_canopen(manager: tuple[Any, lexican.Machine], sensor: Path) -> None:
    network, _ = manager
    node = network.add_node(7, str(sensor))
    data = os.urandom(3000)
    with node.sdo["Calibration"].open("wb", size=len(data), block_transfer=True) as file:
        file.write(data)
    with node.sdo["Calibration"].open("rb", block_transfer=True) as file:
        assert file.read() == data


def test_python_canopen_drives_ours() -> None:
    network: Any = canopen.Network()
    network.connect(interface="lexican", channel="sim:siko/ag03-1?node=5")
    try:
        node = network.add_node(5)
        assert node.sdo.upload(0x1018, 1) == b"\x95\x01\x00\x00"
    finally:
        network.disconnect()


def test_we_manage_a_device_of_python_canopen(sensor: Path) -> None:
    theirs: Any = canopen.Network()
    theirs.connect(interface="virtual", channel="both ways")
    device = theirs.create_node(7, str(sensor))
    device.nmt.state = "PRE-OPERATIONAL"
    with can.Bus(interface="virtual", channel="both ways") as bus, lexican.Network(bus) as network:
        node = network.add_node(7, sensor)
        assert node.read("pressure").value == -7
        node.write("name", "left")
        assert device.sdo["Name"].raw == "left"
        data = os.urandom(900)
        network.write_bytes(7, 0x2001, 0, data)
        assert device.get_data(0x2001, 0) == data
        assert network.read_bytes(7, 0x2001) == data
        assert network.scan() == [7]
        events = network.events()
        device.emcy.send(0x5000, 0x81)
        event = events.next(5.0)
        assert event and (event.what, event.code) == ("emergency", 0x5000)
        network.close()
        time.sleep(0.2)
        device.emcy.send(0x5001, 0x81)
        assert bus.recv(1.0), "a network that is closed takes no frames from the bus"
    theirs.disconnect()


def test_frames_of_all_kinds_pass(manager: tuple[Any, lexican.Machine]) -> None:
    channel: Any = manager[1]
    with can.Bus(interface="lexican", channel=channel) as one, can.Bus(interface="lexican", channel=channel) as two:
        for sent in (
            can.Message(arbitration_id=0x123, is_extended_id=False, data=b"\x01\x02"),
            can.Message(arbitration_id=0x1234567, is_extended_id=True, data=b""),
            can.Message(arbitration_id=0x321, is_extended_id=False, is_remote_frame=True, dlc=3),
        ):
            one.send(sent)
            got = two.recv(2.0)
            assert got and got.equals(sent, timestamp_delta=None, check_channel=False), got
        with pytest.raises(can.CanOperationError, match="CAN FD"):
            one.send(can.Message(arbitration_id=1, is_fd=True))
    with pytest.raises(can.CanInitializationError, match="no-such"):
        can.Bus(interface="lexican", channel="no-such-bus")


def test_a_drive_that_outlives_its_network_lets_go_of_a_bus_of_python_can() -> None:
    channel: Any = lexican.simulate("siko/ag03-1", pace="real")
    with channel, can.Bus(interface="lexican", channel=channel) as bus:
        for _ in range(5):
            with lexican.Network(bus) as network:
                drive = network.add_node(1, "siko/ag03-1").drive()
                drive.close()
            del network, drive  # Its thread waited for the interpreter, and this one for it.
