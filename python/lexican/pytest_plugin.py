"""The pytest plugin: simulated machines as fixtures, and the conformance test of a device as items.

``pytest --lexican-conform 5 --lexican-bus can0 --lexican-sheet x.eds`` runs each case as an item with its id, which ``-k`` selects.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    import lexican
    from lexican._native import CaseResult, Conformance

BUS = "the bus of the fixture lexican_bus and of the conformance test: can0, or sim:siko/ag03-1?node=5"
MACHINE = "the machine.toml, or the device, that the fixture lexican_machine simulates"

KEY: pytest.StashKey[Conformance] = pytest.StashKey()
LEFT: pytest.StashKey[list[str]] = pytest.StashKey()


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("lexican", "CANopen")
    group.addoption("--lexican-bus", metavar="URL", help=BUS)
    group.addoption("--lexican-machine", metavar="FILE", help=MACHINE)
    group.addoption("--lexican-conform", metavar="NODE", type=int, help="run the conformance test of this node-ID")
    group.addoption("--lexican-sheet", metavar="FILE", help="the data sheet of the device that is tested")
    help = "what the test may do that moves a machine or outlasts it: motion, outputs, manufacturer, store, restore, node-id"
    group.addoption("--lexican-allow", metavar="NAME", action="append", default=[], help=help)
    parser.addini("lexican_bus", BUS)
    parser.addini("lexican_machine", MACHINE + ", relative to this file")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "lexican_machine(file): what lexican_machine simulates in this test, relative to it")


@pytest.fixture
def lexican_machine(request: pytest.FixtureRequest) -> Iterator[lexican.Machine]:
    """A simulated machine in virtual time: that of the marker, of ``--lexican-machine``, or of the ini file."""
    import lexican

    config = request.config
    marker = request.node.get_closest_marker("lexican_machine")
    if marker:
        name, folder = marker.args[0], request.path.parent
    elif name := config.getoption("lexican_machine"):
        folder = config.invocation_params.dir
    elif name := config.getini("lexican_machine"):
        folder = (config.inipath or config.rootpath / "pytest.ini").parent
    else:
        pytest.fail("which machine? @pytest.mark.lexican_machine(FILE), --lexican-machine, or lexican_machine in pytest.ini")
    # A name that is of no file is that of a device.
    file = folder / name
    with lexican.simulate(file if file.exists() else name) as machine:
        yield machine


@pytest.fixture
def lexican_bus(request: pytest.FixtureRequest) -> Iterator[lexican.Network]:
    """The network on the bus of ``--lexican-bus``, or of the ini file."""
    import lexican

    with lexican.Network(_bus(request.config)) as network:
        yield network


def _bus(config: pytest.Config) -> str:
    url = config.getoption("lexican_bus") or config.getini("lexican_bus")
    if not url:
        raise pytest.UsageError("which bus? --lexican-bus, or lexican_bus in pytest.ini")
    return str(url)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(session: pytest.Session, config: pytest.Config, items: list[pytest.Item]) -> None:
    node = config.getoption("lexican_conform")
    if node is None:
        return
    import lexican
    from lexican._native import Conformance

    sheet: str | None = config.getoption("lexican_sheet")
    allow: list[str] = config.getoption("lexican_allow") or []
    try:
        test = Conformance(_bus(config), node, sheet, allow=allow)
    except lexican.LexicanError as error:
        raise pytest.UsageError(f"--lexican-conform: {error}") from error
    suite = Suite.from_parent(session, name="lexican-conform", nodeid="lexican-conform")  # pyright: ignore[reportUnknownMemberType]
    suite.test = config.stash[KEY] = test
    items.extend(suite.collect())


class Suite(pytest.Collector):
    """The cases for a device. The test begins with the first that is run."""

    test: Conformance
    has_begun = False

    def collect(self) -> Iterator[Case]:
        for id, title in self.test.cases():
            case = Case.from_parent(self, name=id)  # pyright: ignore[reportUnknownMemberType]
            case.title = title
            yield case

    def next(self) -> CaseResult | None:
        if not self.has_begun:
            self.test.begin([item.name for item in self.session.items if item.parent is self])
            self.has_begun = True
        return self.test.next()


class Case(pytest.Item):
    """A case, as it ends in the report: what does not apply, is not allowed or cannot be decided is skipped, and what a standard only
    recommends is expected to fail."""

    title: str

    def runtest(self) -> None:
        suite = self.parent
        assert isinstance(suite, Suite)
        result = suite.next()
        if result is None:
            raise Failed("the test has ended before this case")
        if result.id != self.name:
            raise Failed(f"{result.id} is next, and not this case: the cases are run in the order in which they were collected")
        if result.verdict == "advised":
            pytest.xfail(f"recommended: {result.reason}")
        if result.verdict in ("not applicable", "not allowed", "not decidable"):
            pytest.skip(f"{result.verdict}: {result.reason}")
        if result.verdict != "passed":
            raise Failed(result.text)

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None) -> str:
        if isinstance(excinfo.value, Failed):
            return str(excinfo.value)
        return str(super().repr_failure(excinfo))

    def reportinfo(self) -> tuple[Path, None, str]:
        return self.path, None, f"{self.name} {self.title}"


class Failed(Exception):
    """A case has not passed."""


@pytest.hookimpl(tryfirst=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    test = session.config.stash.get(KEY, None)
    if test is None:
        return
    left = session.config.stash[LEFT] = test.close()
    if left and session.exitstatus == pytest.ExitCode.OK:
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    none: list[str] = []
    for line in config.stash.get(LEFT, none):
        terminalreporter.write_line(f"lexican-conform: {line}", red=True)
