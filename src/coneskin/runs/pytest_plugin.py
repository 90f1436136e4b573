"""Plugin for pytest: every recording in a folder is a test, and fixtures for a skin, a controller and a replay.

    pytest --coneskin-runs runs/                     each run against its golden events
    pytest --coneskin-runs runs/ --coneskin-update   after a review: today's events are the golden ones
    pytest --coneskin-runs runs/ --coneskin-tolerance place_mm=0.5 --coneskin-tolerance time_ms=5

In pyproject.toml: ``coneskin_runs = ["runs"]`` and ``coneskin_tolerances = ["place_mm=0.5"]``. Where none of it is
used, nothing of coneskin is loaded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from coneskin.robot.sim.process import SimulatedController
    from coneskin.skin.sensor import Sensor
    from coneskin.skin.virtual.scripted_touch import ScriptedTouch
    from coneskin.skin.virtual.skin import VirtualSkin

    from .decisions import Decisions
    from .replay.event_details import Tolerances

_UPDATED_FILES = pytest.StashKey[list[str]]()
_RUN_FOLDERS = pytest.StashKey[tuple[Path, ...]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Declare the options (called by pytest)."""
    group = parser.getgroup("coneskin", "recorded runs as tests")
    group.addoption(
        "--coneskin-runs", action="append", default=[], metavar="DIR", help="every recording below it is a test"
    )
    group.addoption(
        "--coneskin-update", action="store_true", help="write what differs as the golden events, after a review"
    )
    group.addoption(
        "--coneskin-tolerance",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="place_mm, angle_deg, level, speed_rad_s, time_ms or relative: what does not count",
    )
    parser.addini("coneskin_runs", "folders whose recordings are tests", type="paths", default=[])
    parser.addini("coneskin_tolerances", "what does not count, as NAME=VALUE", type="linelist", default=[])


def pytest_configure(config: pytest.Config) -> None:
    """Add the folders of runs to what is collected (called by pytest)."""
    config.stash[_UPDATED_FILES] = []
    _tolerances(config)  # one that does not exist is refused, whatever is collected
    named = [config.invocation_params.dir / name for name in config.getoption("--coneskin-runs")]
    folders = tuple(path.resolve() for path in (*named, *config.getini("coneskin_runs")))
    config.stash[_RUN_FOLDERS] = folders
    for folder in folders:
        if not folder.exists():
            raise pytest.UsageError(f"--coneskin-runs: there is no folder {folder}")
        collected = [(config.invocation_params.dir / word.partition("::")[0]).resolve() for word in config.args]
        if not any(folder.is_relative_to(path) for path in collected):
            config.args.append(str(folder))


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Return the collector of a recording in one of the folders (called by pytest)."""
    if file_path.suffix != ".rec":
        return None
    folders = parent.config.stash[_RUN_FOLDERS]
    if not any(file_path.resolve().is_relative_to(folder) for folder in folders):
        return None
    from .run_files import is_further_part

    return None if is_further_part(file_path) else _RecordedRunFile.from_parent(parent, path=file_path)


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """List what was written (called by pytest)."""
    for name in config.stash.get(_UPDATED_FILES, []):
        terminalreporter.write_line(f"coneskin: golden events written: {name}; review the difference before you commit")


class _RecordedRunFile(pytest.File):
    """Recording, as pytest collects it."""

    def collect(self) -> Iterator[pytest.Item]:
        yield _RecordedRunItem.from_parent(self, name="golden")


class _RecordedRunItem(pytest.Item):
    """Test of one recording against its golden events."""

    def runtest(self) -> None:
        """Replay the run and compare."""
        from .comparison import comparison_lines
        from .event_file import check_golden, update_golden

        tolerances = _tolerances(self.config)
        if self.config.getoption("--coneskin-update"):
            if written := update_golden(self.path, tolerances):
                self.config.stash[_UPDATED_FILES].append(str(written))
            return
        comparison = check_golden(self.path, tolerances)
        if not comparison.same:
            lines = "\n".join(comparison_lines(comparison))
            hint = "  if that is meant: review it, then run again with --coneskin-update"
            raise _RunDiffers(f"{self.path}: {lines}\n{hint}")

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        """Return the lines for a person; a traceback only where it is ours that fails."""
        from coneskin.core.errors import ConeSkinError
        from coneskin.core.text import printable

        if isinstance(excinfo.value, _RunDiffers | ConeSkinError):
            return printable(str(excinfo.value))
        return super().repr_failure(excinfo, style)

    def reportinfo(self) -> tuple[Path, None, str]:
        """Return where the test stands."""
        return self.path, None, f"recorded run {self.path.name}"


class _RunDiffers(AssertionError):
    """A run is not as its golden events."""


def _tolerances(config: pytest.Config) -> Tolerances | None:
    """Return what does not count; None without any, so that nothing of coneskin is loaded."""
    words = [*config.getini("coneskin_tolerances"), *config.getoption("--coneskin-tolerance")]
    if not words:
        return None
    from coneskin.core.errors import RecordingError

    from .replay.event_details import Tolerances

    try:
        return Tolerances.from_words(words)
    except RecordingError as exc:
        raise pytest.UsageError(f"--coneskin-tolerance: {exc}") from exc


@pytest.fixture
def replayed() -> Callable[..., Decisions]:
    """Return a function that replays a recording: ``replayed("run.rec", {"reaction.kind": "stop"})``.

    It gives what today's guard decides, with the settings: ``events`` and ``commands``. A run that is not whole fails.
    """

    def replay_file(path: Path | str, settings: Mapping[str, Any] | None = None) -> Decisions:
        from .decisions import decide_again
        from .replay.run import read_run

        run = read_run(path)
        if not run.complete:
            pytest.fail(f"{path} is incomplete: {run.missing}", pytrace=False)
        return decide_again(run, settings)

    return replay_file


@pytest.fixture
def virtual_skin() -> Callable[..., VirtualSkin]:
    """Return a function that makes a virtual skin: ``virtual_skin([touch], duration=0.5)``.

    Without ``sensor`` it is a tube of 54 mm radius and 434 mm length. The other arguments are those of
    ``coneskin.VirtualSkin``; ``packets()`` of it yields simulated time and bytes, so that nothing sleeps.
    """

    def make(
        touches: Sequence[ScriptedTouch] = (), sensor: Sensor | Sequence[Sensor] | None = None, **options: Any
    ) -> VirtualSkin:
        from coneskin.geometry.frustum import Frustum
        from coneskin.skin.sensor import Sensor
        from coneskin.skin.virtual.skin import VirtualSkin

        return VirtualSkin(Sensor(Frustum(0.054, 0.054, 0.434)) if sensor is None else sensor, touches, **options)

    return make


@pytest.fixture
def ur_controller(request: pytest.FixtureRequest) -> Iterator[SimulatedController]:
    """Yield a simulated UR controller, a process of its own that ``ur_rtde`` connects to at ``ur_controller.host``.

    Its arguments: ``@pytest.mark.parametrize("ur_controller", [{"model": "UR10e"}], indirect=True)``.
    """
    from coneskin.robot.sim.process import SimulatedController, free_host

    options = {"model": "UR5e", "host": free_host(), **getattr(request, "param", {})}
    with SimulatedController(**options) as controller:
        yield controller
