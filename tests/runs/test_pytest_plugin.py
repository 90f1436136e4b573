"""The plugin in a pytest of its own, found by its entry point as in an installed package."""

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.support.paths import ROOT

COLLISION = ROOT / "tests" / "data" / "collision.rec"


class Project:
    """A user's project: a folder with recordings and nothing else."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.runs = folder / "runs"
        self.runs.mkdir()
        project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        points = project["entry-points"]["pytest11"]
        self._site = folder / "site"
        info = self._site / "as_installed-1.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: as-installed\nVersion: 1\n")
        lines = [f"{name} = {module}" for name, module in points.items()]
        (info / "entry_points.txt").write_text("\n".join(["[pytest11]", *lines]))

    def pytest(self, *words: str, code: int) -> str:
        """Run pytest in the folder and return what it prints."""
        path = os.pathsep.join([str(self._site), str(ROOT / "src"), os.environ.get("PYTHONPATH", "")])
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--rootdir", ".", *words],
            cwd=self.folder,
            env={**os.environ, "PYTHONPATH": path},
            capture_output=True,
            text=True,
            timeout=180,
        )
        assert done.returncode == code, done.stdout + done.stderr
        return done.stdout + done.stderr


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project(tmp_path)


def golden(project: Project, change: object = None) -> None:
    """Write golden events that are the recorded ones, changed."""
    from coneskin.runs.event_file import event_facts
    from coneskin.runs.replay.run import read_run

    run = read_run(COLLISION)
    events = event_facts(run.events, run.start)
    if change is not None:
        change(events)
    (project.runs / "collision.events.json").write_text(json.dumps({"events": events}))


@pytest.mark.long
def test_a_tolerance_that_does_not_exist_is_refused_whatever_is_collected(project: Project) -> None:
    out = project.pytest("--coneskin-tolerance", "plaec_mm=1", code=4)
    assert "--coneskin-tolerance: there is no tolerance plaec_mm; there are place_mm" in out


@pytest.mark.long
def test_every_recording_is_a_test_and_an_incomplete_one_fails(project: Project) -> None:
    whole = COLLISION.read_bytes()
    (project.runs / "collision.rec").write_bytes(whole)
    (project.runs / "torn").mkdir()
    (project.runs / "torn" / "run.rec").write_bytes(whole[: len(whole) // 2])
    (project.runs / "nothing.rec").write_bytes(b"no recording")
    out = project.pytest("--coneskin-runs", "runs", "-v", code=1)
    assert re.search(r"runs/collision\.rec::golden PASSED", out)
    assert re.search(r"runs/torn/run\.rec::golden FAILED", out)
    assert "is incomplete, so it proves nothing" in out
    assert re.search(r"runs/nothing\.rec::golden FAILED", out)
    assert "no recording of coneskin" in out
    assert "Traceback" not in out
    assert "2 failed, 1 passed" in out


@pytest.mark.long
def test_a_failure_reads_in_millimetres_and_milliseconds_and_a_review_mends_it(project: Project) -> None:
    def reviewed_before(events: list[dict]) -> None:
        for event in events:
            if event["name"] == "contact":
                event["u"] -= 0.0012
            if event["name"] == "stopping":
                event["t"] -= 0.0022

    (project.runs / "collision.rec").write_bytes(COLLISION.read_bytes())
    golden(project, reviewed_before)
    out = project.pytest("--coneskin-runs", "runs", code=1)
    assert "contact 1: u 128.6 -> 129.8 mm; stop 2.2 ms later" in out
    assert "--coneskin-update" in out
    assert "0x1" not in out
    tolerant = ["--coneskin-tolerance", "place_mm=1.5", "--coneskin-tolerance", "time_ms=3"]
    project.pytest("--coneskin-runs", "runs", *tolerant, code=0)
    out = project.pytest("--coneskin-runs", "runs", "--coneskin-update", code=0)
    assert "golden events written: " in out
    out = project.pytest("--coneskin-runs", "runs", "--coneskin-update", code=0)
    assert "golden events written" not in out
    assert "1 passed" in project.pytest("--coneskin-runs", "runs", code=0)


@pytest.mark.long
def test_the_settings_stand_in_the_projects_file_as_well(project: Project) -> None:
    def moved(events: list[dict]) -> None:
        next(event for event in events if event["name"] == "contact")["u"] += 0.0004

    (project.runs / "collision.rec").write_bytes(COLLISION.read_bytes())
    golden(project, moved)
    ini = '[tool.pytest.ini_options]\nconeskin_runs = ["runs"]\nconeskin_tolerances = [{}]\n'
    (project.folder / "pyproject.toml").write_text(ini.format('"place_mm=0.5"'))
    assert "1 passed" in project.pytest(code=0)
    (project.folder / "pyproject.toml").write_text(ini.format(""))
    assert "1 failed" in project.pytest(code=1)
    (project.folder / "pyproject.toml").write_text(ini.format('"place=1"'))
    assert "there is no tolerance place; there are place_mm" in project.pytest(code=4)
    (project.folder / "pyproject.toml").write_text(ini.format(""))
    assert "there is no folder" in project.pytest("--coneskin-runs", "nowhere", code=4)


@pytest.mark.long
def test_where_it_is_not_used_nothing_is_loaded_and_recordings_are_no_tests(project: Project) -> None:
    (project.runs / "collision.rec").write_bytes(COLLISION.read_bytes())
    (project.folder / "test_mine.py").write_text(
        "import sys\n\n\ndef test_nothing_is_loaded():\n"
        "    mine = {name for name in sys.modules if name.startswith('coneskin')}\n"
        "    assert mine == {'coneskin', 'coneskin.runs', 'coneskin.runs.pytest_plugin'}\n"
        "    assert 'numpy' not in sys.modules\n"
    )
    assert "1 passed" in project.pytest(code=0)


@pytest.mark.long
def test_the_fixtures(project: Project) -> None:
    (project.folder / "test_mine.py").write_text(
        "import coneskin as cs\n\n\n"
        "def test_a_what_if(replayed):\n"
        f"    stopped = replayed({str(COLLISION)!r}, {{'reaction.kind': 'stop'}})\n"
        "    assert 'retreating' not in [event.name for event in stopped.events]\n"
        f"    assert 'retreating' in [event.name for event in replayed({str(COLLISION)!r}).events]\n\n\n"
        "def test_a_skin(virtual_skin):\n"
        "    skin = virtual_skin([cs.ScriptedTouch(start=0.2, end=0.3, u=0.2, phi=1.5)], duration=0.4)\n"
        "    stream = cs.TouchStream(skin.sensors)\n"
        "    events = [event for time, data in skin.packets() for event in stream.feed(data, time)]\n"
        "    assert abs(events[0].u - 0.2) < 2e-3\n\n\n"
        "def test_a_controller(ur_controller):\n"
        "    import socket\n\n"
        "    socket.create_connection((ur_controller.host, 30004), timeout=60).close()\n"
    )
    assert "3 passed" in project.pytest(code=0)
