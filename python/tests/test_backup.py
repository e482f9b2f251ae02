"""Backup and restore: what was saved is there again, and what was not is said."""

from __future__ import annotations

import asyncio
import signal
import sys
from pathlib import Path

import lexican
import pytest
from lexican import aio

MACHINE = """\
[node.feeder]
id = 5
sheet = "siko/ag03-1"

[node.sensor]
id = 7
sheet = "sensor.eds"
"""


def parameters(node: lexican.Node) -> dict[str, object]:
    """Some of its parameters."""
    return {name: node.read(name).value for name in ("spindle pitch", "position window", "target position")}


def change(node: lexican.Node) -> None:
    node.write("spindle pitch", "4.00 mm")
    node.write("position window", 77)


def test_a_node_is_as_it_was_saved(network: lexican.Machine, tmp_path: Path) -> None:
    dcf = tmp_path / "drive.dcf"
    steps: list[tuple[str, int, int]] = []
    node = network[1]
    before = parameters(node)
    assert node.backup(dcf, progress=lambda what, at, of: steps.append((what, at, of))) == []
    assert steps[0][1] == 1 and steps[-1][1] == steps[-1][2] == len(steps) and steps[-1][0].startswith("reading ")
    configured = {(entry.index, entry.sub): entry.value for entry in lexican.load(dcf).configured()}
    assert configured[0x6067, 0] == before["position window"] and (0x607A, 0) not in configured, "a set-point is no parameter"
    change(node)
    assert parameters(node) != before
    restored = node.restore(dcf)
    assert parameters(node) == before
    assert (0x6067, 0) in restored.written and restored.equal + len(restored.written) == len(configured)
    again = node.restore(dcf)
    assert (again.written, again.equal, again.stored) == ([], len(configured), False)
    with pytest.raises(lexican.LexicanError, match="0 parameters written, .* had their value; 1010:01: the device aborts"):
        node.restore(dcf, store=True)


def test_a_node_stores_what_it_is_told_to(tmp_path: Path) -> None:
    with lexican.simulate("kollmorgen/akd", node=5) as network:
        network[5].backup(tmp_path / "akd.dcf")
        assert network[5].restore(tmp_path / "akd.dcf", store=True).stored


def test_domains_are_files_beside_it(sensor: Path) -> None:
    with lexican.simulate(sensor, node=7) as network:
        network.write_bytes(7, 0x2001, 0, bytes(3000))
        network[7].backup(sensor.with_name("left.dcf"), domains=True)
        network.write_bytes(7, 0x2001, 0, b"other")
        assert network[7].restore(sensor.with_name("left.dcf")).written == [(0x2001, 0)]
        assert network.read_bytes(7, 0x2001) == bytes(3000)


def test_a_restore_that_is_interrupted_says_what_was_written(network: lexican.Machine, tmp_path: Path) -> None:
    dcf = tmp_path / "drive.dcf"
    node = network[1]
    before = parameters(node)
    node.backup(dcf)
    change(node)

    def stop(what: str, at: int, of: int) -> None:
        if what.startswith("writing") and at == 2:
            raise RuntimeError("mine")

    with pytest.raises(RuntimeError, match="mine") as interrupted:
        node.restore(dcf, progress=stop)
    if sys.version_info >= (3, 11):
        (note,) = interrupted.value.__notes__
        assert "node1: 1 parameter written" in note and "goes on from there" in note
    assert len(node.restore(dcf).written) == 1 and parameters(node) == before


def test_a_restore_notices_a_restart_and_a_node_that_is_gone(network: lexican.Machine, tmp_path: Path) -> None:
    dcf = tmp_path / "drive.dcf"
    node = network[1]
    node.backup(dcf)

    def restarts(what: str, at: int, of: int) -> None:
        if what.startswith("writing") and at == 1:
            network.carry_out("node1", "power off")
            network.carry_out("node1", "power on")
            network.sleep(0.5)

    change(node)
    with pytest.raises(lexican.LexicanError, match="has restarted meanwhile; node1: .* written"):
        node.restore(dcf, progress=restarts)
    change(node)

    def gone(what: str, at: int, of: int) -> None:
        if what.startswith("writing"):
            network.carry_out("node1", "power off")

    with pytest.raises(lexican.LexicanError, match="node1: 0 parameters written") as lost:
        node.restore(dcf, progress=gone)
    assert "no answer" in str(lost.value)


def test_ctrl_c_interrupts_a_backup_and_nothing_is_saved(network: lexican.Machine, tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        network[1].backup(tmp_path / "drive.dcf", progress=lambda what, at, of: signal.raise_signal(signal.SIGINT))
    assert list(tmp_path.iterdir()) == []


def test_another_device_is_not_written(network: lexican.Machine, sensor: Path) -> None:
    dcf = sensor.with_suffix(".dcf")
    with lexican.simulate(sensor, node=7) as other:
        other[7].write("producer heartbeat time", 250)
        other[7].backup(dcf)
    with pytest.raises(lexican.LexicanError, match="it is another device: its vendor is 195h, by the data sheet 123h"):
        network[1].restore(dcf)
    assert network[1].read(0x1017).value != 250
    with pytest.raises(lexican.LexicanError, match="2002:00: the device aborts"):
        network[1].restore(dcf, force=True)
    assert network[1].read(0x1017).value == 250, "the rest is there"


def test_a_machine_is_as_it_was_saved(sensor: Path) -> None:
    file = sensor.with_name("machine.toml")
    file.write_text(MACHINE)
    saved = sensor.with_name("machine.tar")
    with lexican.simulate(file) as machine:
        machine.sensor.write("name", "left")
        before = parameters(machine.feeder)
        assert machine.backup(saved) == []
        change(machine.feeder)
        machine.sensor.write("name", "right")
        restored = machine.restore(saved)
        assert set(restored) == {"feeder", "sensor"} and restored["sensor"].written == [(0x2002, 0)]
        assert parameters(machine.feeder) == before and machine.sensor.read("name").value == "left"
        machine.carry_out("sensor", "power off")
        (missing,) = machine.backup(saved)
        assert missing.startswith("sensor: ")
        saved.write_bytes(b"no archive")
        with pytest.raises(lexican.LexicanError, match="no backup of a machine"):
            machine.restore(saved)


def test_the_same_in_asyncio(sensor: Path) -> None:
    async def main() -> None:
        async with aio.Machine(lexican.simulate(sensor, node=7)) as machine:
            await machine.node(7).write("name", "left")
            await machine.backup(sensor.with_name("machine.tar"))
            await machine.node(7).write("name", "right")
            await machine.restore(sensor.with_name("machine.tar"))
            assert (await machine.node(7).read("name")).value == "left"
            assert await machine.node(7).backup(sensor.with_name("left.dcf")) == []
            assert (await machine.node(7).restore(sensor.with_name("left.dcf"))).written == []
            (pdo,) = await machine.node(7).pdos()
            assert pdo.blocking.name == "TPDO1" and await pdo.latest() is None and await pdo.next(0.1) is None
            assert (await pdo.decode([b"\xf9\xff"]))["Pressure"].tolist() == [-7]

    asyncio.run(main())
