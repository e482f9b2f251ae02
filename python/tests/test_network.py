"""Networks in virtual time: values, transfers, events."""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from pathlib import Path

import lexican
import pytest
from lexican import aio

from conftest import OVERLAY


def test_six_lines_move_a_drive() -> None:
    with lexican.Network("sim:siko/ag03-1") as network:
        drive = network.node(1).drive()
        drive.enable()
        assert drive.move_to(5000)
        assert drive.position() == 5000


def test_objects_are_read_and_written_by_name_and_unit(network: lexican.Machine) -> None:
    node = network[1]
    node.write("spindle pitch", "4.00 mm")
    node.write("position window", "0.05 mm")
    window = node.read(0x6067)
    assert (window.value, window.unit, window.scaled, str(window)) == (5, "mm", 0.05, "0.05 mm")
    assert (int(window), float(window), window.raw) == (5, 0.05, b"\x05\x00")
    node.write((0x6067, 0), 7)
    assert network.read_bytes(1, 0x6067) == b"\x07\x00"
    identity = node.read_all(0x1018)
    assert [it.sub for it in identity] == [0, 1, 2, 3, 4] and identity[1].value == 0x195


def test_what_fails_is_an_exception_with_its_reason(network: lexican.Machine) -> None:
    with pytest.raises(lexican.SdoAborted, match="object does not exist") as aborted:
        network.read_bytes(1, 0x5000, 3)
    assert (aborted.value.code, aborted.value.index, aborted.value.sub) == (0x0602_0000, 0x5000, 3)
    with pytest.raises(lexican.NoAnswer, match="node 9") as silent:
        network.read_bytes(9, 0x1000)
    assert silent.value.index == 0x1000
    with pytest.raises(lexican.ValueRefused, match="6067:00"):
        network[1].write("position window", "much")
    with pytest.raises(lexican.LexicanError, match="node-ID 9 has no data sheet"):
        network.node(9)
    for node in (0, 128):
        with pytest.raises(lexican.LexicanError, match="they are 1 to 127"):
            network.read_bytes(node, 0x1000)
    with pytest.raises(lexican.LinkFailed, match="no-such-bus"):
        lexican.Network("no-such-bus")
    with pytest.raises(TypeError, match="python-can"):
        lexican.Network(5)  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]
    network.close()
    with pytest.raises(lexican.Closed):
        network.read_bytes(1, 0x1000)


def test_nodes_are_found_and_named(sensor: Path) -> None:
    with lexican.simulate(sensor, node=7) as network:
        assert network.scan() == [7]
        overlay = sensor.with_name("sensor.toml")
        overlay.write_text(OVERLAY)
        left = network.add_node(9, lexican.load(sensor, [overlay]), name="left")
        network.add_node(10, sensor, [overlay])
        assert (left.id, [node.name for node in network.nodes()]) == (9, ["node7", "left", "node10"])
        with pytest.raises(lexican.MachineFileError, match="have the same node-ID"):
            network.add_node(9, sensor)
        assert str(network.node(7).read("pressure")) == "-7"


@pytest.mark.parametrize("length", [5, 63, 64, 127 * 7, 100_000])
def test_long_transfers_come_back(sensor: Path, length: int) -> None:
    data = os.urandom(length)
    with lexican.simulate(sensor, node=7) as network:
        network.write_bytes(7, 0x2001, 0, data)
        assert network.read_bytes(7, 0x2001) == data
        network[7].write("calibration", data[::-1])
        assert network[7].read("calibration").raw == data[::-1]


MACHINE = """\
[bus]
manager = 127

[node.feeder]
id = 5
sheet = "siko/ag03-1"
heartbeat = "100 ms"
settings = { "spindle pitch" = "4.00 mm" }

[wire]
"feeder.statusword" = "manager"
"""


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    path = tmp_path / "machine.toml"
    path.write_text(MACHINE)
    return path


def until(events: lexican.Events, what: str) -> lexican.Event:
    """The next event of a kind."""
    while True:
        event = events.next(5.0)
        assert event is not None, f"no {what}"
        if event.what == what:
            return event


def test_a_machine_boots_and_says_what_happens(machine: Path) -> None:
    with lexican.simulate(machine) as it:
        events = it.events()
        it.boot()
        assert it.feeder.name == "feeder" and it.feeder.read("spindle pitch").scaled == 4.0
        assert "Statusword" in until(events, "pdo").values
        it.carry_out("feeder", "fault = \"D\"")
        emergency = until(events, "emergency")
        assert emergency.node == "feeder" and emergency.code
        it.carry_out("feeder", "power off")
        assert str(until(events, "lost")) == "feeder: is lost"
        it.carry_out("feeder", "power on")
        assert until(events, "booted").node == "feeder"
        with pytest.raises(AttributeError, match="there is no node"):
            it.feder


def test_a_machine_with_a_mistake_is_refused_with_its_line(machine: Path) -> None:
    machine.write_text(MACHINE.replace("id = 5", "id = 500"))
    with pytest.raises(lexican.MachineFileError, match="machine.toml:5"):
        lexican.simulate(machine)


def test_nmt_and_heartbeat(network: lexican.Machine) -> None:
    events = network.events()
    network.watch_heartbeat(1, 0.5)
    network.nmt("reset-node", 1)
    assert until(events, "booted-up").node == "node1"
    network.write_bytes(1, 0x1017, 0, (100).to_bytes(2, "little"))
    network.sleep(1.0)
    network.carry_out("node1", "power off")
    assert until(events, "lost").node == "node1"
    before = network.now()
    network.sleep(60)
    assert network.now() - before >= 60
    with pytest.raises(ValueError, match="no command of NMT"):
        network.nmt("go")  # type: ignore[arg-type]  # pyright: ignore[reportArgumentType]


def test_threads_share_a_network(network: lexican.Machine) -> None:
    read = [b""] * 8

    def work(at: int) -> None:
        for _ in range(50):
            read[at] = network.read_bytes(1, 0x1018, 1)

    threads = [threading.Thread(target=work, args=(at,)) for at in range(len(read))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(read) == {b"\x95\x01\x00\x00"}


def test_the_same_in_asyncio(machine: Path) -> None:
    async def main() -> None:
        async with aio.Machine(lexican.simulate(machine)) as it:
            await it.boot()
            feeder = it.node("feeder")
            types = await asyncio.gather(*(feeder.read(0x1018) for _ in range(5)))
            assert {int(number) for number in types} == {1}
            async with await feeder.drive() as drive:
                await drive.enable()
                assert await drive.move_to("12 mm")
                assert str(await feeder.read("position actual value")) == "+12.00 mm"
            it.blocking.carry_out("feeder", "fault = \"D\"")
            async for event in it.events():
                if event.what == "emergency":
                    break

    asyncio.run(main())


def test_callbacks_are_called_and_their_exceptions_are_not_lost(
    machine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unraisable: list[BaseException | None] = []

    def note(it: sys.UnraisableHookArgs) -> None:
        unraisable.append(it.exc_value)

    monkeypatch.setattr(sys, "unraisablehook", note)
    seen: list[str] = []
    states: list[str] = []

    def refuse(event: lexican.Event) -> None:
        raise RuntimeError(f"mine: {event}")

    with pytest.raises(RuntimeError, match="mine: feeder: EMCY"):
        with lexican.simulate(machine) as it:
            it.on(None, lambda event: seen.append(event.what))
            it.on("booted", lambda event: states.append(str(it.feeder.read("statusword"))))
            it.on("emergency", refuse)
            it.boot()
            it.carry_out("feeder", "fault = \"D\"")
            it.sleep(1.0)
    assert {"booted", "ready", "emergency"} <= set(seen), "all that has happened is in it, once it is closed"
    assert [str(error) for error in unraisable][0].startswith("mine: feeder: EMCY")
    assert states


def test_a_callback_may_close_its_network(network: lexican.Machine) -> None:
    closed = threading.Event()

    def close(_: lexican.Event) -> None:
        network.close()
        closed.set()

    network.on("booted-up", close)
    network.nmt("reset-node", 1)
    try:
        network.sleep(1.0)
    except lexican.LexicanError:
        pass  # It was closed meanwhile.
    assert closed.wait(10)


def test_a_pdo_has_its_age(sensor: Path) -> None:
    with lexican.simulate(sensor, node=7) as network:
        (pdo,) = network[7].pdos()
        assert (pdo.name, pdo.cob_id, pdo.latest()) == ("TPDO1", 0x187, None)
        network.nmt("start", 7)
        network.produce_sync(0.1)
        values = pdo.next(1.0)
        assert values and int(values["Pressure"]) == -7
        network.carry_out("node7", "set 2000 -300")
        values = pdo.next(1.0)
        assert values and int(values["Pressure"]) == -300
        network.carry_out("node7", "power off")
        network.sleep(60)
        latest = pdo.latest()
        assert latest and int(latest[0]["Pressure"]) == -300 and latest[1] >= 59.9, "an old value says that it is old"
        assert pdo.next(1.0) is None


def test_lss_gives_node_ids(sensor: Path) -> None:
    sensor.write_text(sensor.read_text().replace("Granularity=8", "Granularity=8\nLSS_Supported=1"))
    with lexican.simulate(sensor, node=7) as network:
        assert lexican.lss_scan(network) == [], "it has one"
        assert lexican.lss_configure(network, 9, store=True)
        assert network.scan() == [9]
        assert lexican.lss_configure(network, 11, (0x123, 7, 0, 0)) and network.scan() == [11]
        with pytest.raises(lexican.LexicanError, match="no device with this identity"):
            lexican.lss_configure(network, 12, (0x123, 8, 0, 0))
    with pytest.raises(lexican.LinkFailed, match="no-such-bus"):
        lexican.lss_scan("no-such-bus")


def test_lss_finds_devices_without_node_id(sensor: Path) -> None:
    sheet = sensor.read_text().replace("Granularity=8", "Granularity=8\nLSS_Supported=1")
    machine = sensor.with_name("machine.toml")
    machine.write_text("")
    for product in (7, 8):
        sensor.with_name(f"{product}.eds").write_text(sheet.replace("DefaultValue=0x7\n", f"DefaultValue={product}\n"))
        with machine.open("a") as file:
            file.write(f'[node.p{product}]\nid = "none"\nsheet = "{product}.eds"\n')
    with lexican.simulate(machine) as network:
        assert network.scan() == []
        found = lexican.lss_scan(network)
        assert {identity[:2] for identity in found} == {(0x123, 7), (0x123, 8)}
        for node, identity in enumerate(sorted(found), 5):
            assert lexican.lss_configure(network, node, identity)
        assert network.scan() == [5, 6] and network.read_bytes(6, 0x1018, 2) == b"\x08\x00\x00\x00"
