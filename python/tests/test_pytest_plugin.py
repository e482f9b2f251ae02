"""The pytest plugin, in sessions of its own."""

from __future__ import annotations

from pathlib import Path

import lexican
import pytest
from lexican._native import Conformance

pytest_plugins = ["pytester"]

MACHINE = """\
[bus]
manager = 127

[node.feeder]
id = 5
sheet = "siko/ag03-1"
heartbeat = "100 ms"
"""

TESTS = """\
import lexican
import pytest

def test_it_boots(lexican_machine):
    lexican_machine.boot()
    assert lexican_machine.feeder.read(0x1018, ).value == 1

@pytest.mark.lexican_machine("siko/ag02")
def test_a_marker_comes_first(lexican_machine):
    assert lexican_machine.read_bytes(1, 0x1018, 1)

def test_the_bus(lexican_bus):
    assert lexican_bus.scan() == [9]
"""


def test_fixtures(pytester: pytest.Pytester) -> None:
    pytester.makefile(".toml", machine=MACHINE)
    pytester.makeini("[pytest]\nlexican_machine = machine.toml\nlexican_bus = sim:siko/ag03-1?node=9\n")
    pytester.makepyfile(TESTS)
    pytester.runpytest("--strict-markers").assert_outcomes(passed=3)
    pytester.makeini("[pytest]\n")
    result = pytester.runpytest("--lexican-machine", "machine.toml")
    result.assert_outcomes(passed=2, errors=1)
    result.stderr.no_fnmatch_line("*Traceback*")


def test_faults_last_as_long_as_their_with(network: lexican.Machine) -> None:
    with network.power_off("node1"), pytest.raises(lexican.NoAnswer):
        network.read_bytes(1, 0x1018, 1)
    network.sleep(1.0)
    with network.mute("node1"), pytest.raises(lexican.NoAnswer):
        network.read_bytes(1, 0x1018, 1)
    before = network.now()
    with network.delay("node1", 0.2):
        assert network.read_bytes(1, 0x1018, 1)
    assert network.now() - before >= 0.2
    before = network.now()
    assert network.read_bytes(1, 0x1018, 1) == b"\x95\x01\x00\x00"
    assert network.now() - before < 0.2
    with pytest.raises(lexican.LexicanError, match="there is no node"), network.mute("feder"):
        pass
    with pytest.raises(lexican.LexicanError, match="no simulated device"), network.power_off("feder"):
        pass


CONFORM = ["--lexican-conform", "5", "--lexican-bus", "sim:siko/ag03-1?node=5"]


def test_the_cases_are_items(pytester: pytest.Pytester, sensor: Path) -> None:
    line = ["--lexican-conform", "7", "--lexican-bus", f"sim:{sensor}?node=7"]
    result = pytester.runpytest(*line, "-k", "301/7.2.4", "-v")
    outcomes = result.parseoutcomes()
    assert outcomes["passed"] > 10 and "failed" not in outcomes and outcomes["deselected"] > 100
    result.stdout.fnmatch_lines(["*lexican-conform::301/7.2.4.3.5/1 PASSED*"])
    assert result.ret == pytest.ExitCode.OK


def test_what_fails_says_what_the_report_says(pytester: pytest.Pytester) -> None:
    # This drive answers to what it does not take with an abort code of its own.
    result = pytester.runpytest(*CONFORM, "-k", "301/7.2.4.3.5", "-rs")
    assert result.ret == pytest.ExitCode.TESTS_FAILED
    result.stdout.fnmatch_lines(
        [
            "*a segment whose toggle bit is wrong is not taken*",
            "failed: *is refused with 0601 0000*",
            "CiA 301, 7.2.4.3.5 *",
            "expected: *0503 0000*",
            "*> 605#1B*",
            "*< 585#80*",
        ]
    )


def test_what_is_missing_is_said(pytester: pytest.Pytester) -> None:
    result = pytester.runpytest("--lexican-conform", "5")
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    result.stderr.fnmatch_lines(["*which bus? --lexican-bus*"])
    result = pytester.runpytest("--lexican-conform", "5", "--lexican-bus", "can0")
    result.stderr.fnmatch_lines(["*a device is tested by its data sheet*"])
    result = pytester.runpytest(*CONFORM, "--lexican-allow", "everything")
    result.stderr.fnmatch_lines(['*"everything" is none of motion*'])


def test_a_test_that_is_given_up_puts_back() -> None:
    test = Conformance("sim:siko/ag03-1?node=5", 5)
    test.begin([id for id, _ in test.cases()][:40])
    results = [test.next() for _ in range(3)]
    assert all(results)
    left = test.close()
    assert [line for line in left if "ended early" not in line] == [] and len(left) == 1
    assert test.next() is None
