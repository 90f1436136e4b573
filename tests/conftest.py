"""Hypothesis profiles, the short run, tests with processes, and the check that a test leaves none of them behind."""

import os
import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# before numpy is loaded: each core has a worker of its own, and threads of linear algebra only wait for each other
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

_TASKS = Path("/proc/self/task")  # Linux; elsewhere only threads are looked at
_HERE = Path(__file__).parent
_WITH_PROCESSES = (  # tests that take turns with a few others; below this folder
    "guarded",
    "impact/simulation/test_live_plant.py",
    "robot/sim/test_command.py",
    "robot/sim/test_wheel.py",
    "robot/ur/test_program_io.py",
    "test_demo_arms.py",
    "test_demos.py",
    "test_measure_controller.py",
    "test_notebook.py",
)
_OUTCOMES = ("passed", "failed", "error", "xfailed", "xpassed", "skipped")  # as pytest names them
_SHORT = "not long"  # the marker expression of the short run, as in pyproject.toml
#: mark -> what stands in each file that has tests with it; other files are not read for it
_MARKED_BY = {"long": ("long", "sweep("), "processes": ("mark.processes",), "hypothesis": ("hypothesis",)}

# A slow machine is no failure, so nothing here depends on time; the same examples every time, so nothing on luck.
_STEADY = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow], "database": None}
# To search is the fuzz profile's, in the same CI run.
settings.register_profile("steady", derandomize=True, max_examples=40, **_STEADY)
settings.register_profile("fuzz", derandomize=False, max_examples=100, print_blob=True, **_STEADY)
settings.load_profile("steady")  # --hypothesis-profile=fuzz takes its place: see scripts/fuzz


def pytest_configure(config: pytest.Config) -> None:
    """Run a test that is named on the command line, long or not."""
    arguments = config.invocation_params.args
    if config.option.markexpr == _SHORT and "-m" not in arguments and any("::" in word for word in config.args):
        config.option.markexpr = ""


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Pass over the files of which -m selects no test: to import all takes each worker seconds in each session."""
    if not (collection_path.match("test_*.py") and " or " not in config.option.markexpr):
        return None
    words = config.option.markexpr.split(" and ")
    if any(word in _MARKED_BY and not _may_be_marked(collection_path, word) for word in words):
        return True
    return True if "not processes" in words and _has_processes(collection_path) else None


@cache
def _may_be_marked(path: Path, mark: str) -> bool:
    if mark == "processes" and _has_processes(path):
        return True
    text = path.read_text(encoding="utf-8")
    return any(word in text for word in _MARKED_BY[mark])


@pytest.hookimpl(tryfirst=True)  # before -m selects
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests with real processes: they mostly wait, and need a share of the computer when they do not.

    Raises:
        pytest.UsageError: a test's mark stands in another file, so that -m would pass over it.
    """
    from coneskin.core.version import code_build

    compiled = code_build() == "compiled"
    items.sort(key=lambda item: item.path.name != "test_demos.py")  # the longest first: at the end one would wait
    for item in items:
        if _has_processes(item.path):
            item.add_marker(pytest.mark.processes)
        for mark in _MARKED_BY:
            if item.get_closest_marker(mark) and not _may_be_marked(item.path, mark):
                raise pytest.UsageError(f"{item.nodeid}: write {_MARKED_BY[mark][0]} in its file, by which -m finds it")
        if compiled and item.get_closest_marker("pure"):
            item.add_marker(pytest.mark.skip("of the pure Python code: it is patched, or its calls are counted"))


@cache
def _has_processes(path: Path) -> bool:
    return any(path.is_relative_to(_HERE / place) for place in _WITH_PROCESSES)


def pytest_report_header(config: pytest.Config) -> list[str]:
    """Say in the first lines which build is tested, and what the short run leaves out.

    Raises:
        pytest.UsageError: compiled modules are not those of the sources beside them.
    """
    from coneskin.core import version

    for path in Path(version.__file__).parents[1].rglob("*.so"):
        source = path.with_name(f"{path.name.partition('.')[0]}.py")
        if source.exists() and source.stat().st_mtime > path.stat().st_mtime:
            raise pytest.UsageError(f"{source} is newer than its compiled module: make compiled, or make pure")
    lines = [f"coneskin: {version.code_build()}"]
    if config.option.markexpr == _SHORT:
        lines.append("short run: tests marked long are deselected; `make check` or `pytest -m ''` runs them too")
    return lines


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Add to the file that CONESKIN_TEST_SUMMARY names what became of the tests, and why some were skipped."""
    path = os.environ.get("CONESKIN_TEST_SUMMARY")
    if not path or "PYTEST_XDIST_WORKER" in os.environ:  # a worker's are among those of all
        return
    stats = terminalreporter.stats
    words = [f"{len(stats[name])} {name}" for name in _OUTCOMES if stats.get(name)]
    why = Counter(report.longrepr[2].removeprefix("Skipped: ") for report in stats.get("skipped", ()))
    lines = [f"{os.environ.get('CONESKIN_TEST_LABEL', 'tests')}: {', '.join(words) or 'none'}"]
    lines += [f"  {count} skipped: {reason}" for reason, count in why.most_common()]
    with Path(path).open("a", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")


def _children() -> frozenset[str]:
    """Return the processes that any thread of this one has started and that have not been waited for."""
    found: set[str] = set()
    for task in _TASKS.glob("*/children"):
        with suppress(OSError):  # that thread has just ended
            found.update(task.read_text().split())
    return frozenset(found)


@pytest.fixture(autouse=True)
def _nothing_is_left() -> Iterator[None]:
    """Fail the test that leaks a thread or a child process.

    A thread that is about to end has a moment to do so. Threads that libraries keep for good carry no name of ours and
    begin in their pools, which are told by "pool" or "Executor" in the name.
    """
    threads, children = set(threading.enumerate()), _children()
    yield
    for thread in set(threading.enumerate()) - threads:
        if "pool" not in thread.name.lower() and "executor" not in thread.name.lower():
            thread.join(30.0)
            assert not thread.is_alive(), f"the test leaves the thread {thread.name!r}"
    left = _children() - children
    assert not left, f"the test leaves the processes {', '.join(sorted(left))}"
