"""A program of ur_rtde and its guarded twin: how many lines differ, and whether the arm goes the same way."""

import difflib
import math
import subprocess
import sys
import threading

import numpy as np
import pytest

from coneskin.robot.arm.kinematics import forward
from coneskin.robot.arm.models import arm_model
from coneskin.robot.ur.rtde_connection import StateReader
from tests.support.scenes import START

pytestmark = pytest.mark.long
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402
from tests.support.paths import ROOT  # noqa: E402

FOLDER = ROOT / "demos" / "ur_rtde"
PROGRAM, GUARDED = FOLDER / "pick_and_place.py", FOLDER / "pick_and_place_guarded.py"


def changed_lines(before, after):
    """Lines that have to be typed or taken out: of a replaced block the longer side."""
    matcher = difflib.SequenceMatcher(None, before, after, autojunk=False)
    return sum(max(i2 - i1, j2 - j1) for tag, i1, i2, j1, j2 in matcher.get_opcodes() if tag != "equal")


def test_at_most_8_lines_change() -> None:
    before, after = (path.read_text(encoding="utf-8").splitlines() for path in (PROGRAM, GUARDED))
    assert changed_lines(before, after) <= 8
    assert len(after) > 60
    assert not any("rtde_" in line.partition("#")[0] for line in after if "import" in line)


class Way:
    """Way of an arm: its joint positions in time, read beside whatever moves it."""

    def __init__(self, host):
        self.q = []
        self._host, self._done = host, threading.Event()
        self._thread = threading.Thread(target=self._read)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._done.set()
        self._thread.join()

    def _read(self):
        with StateReader(self._host) as reader:
            while not self._done.is_set():
                self.q.append(reader.wait(60.0).q)

    def points(self):
        """Where the flange was, one point for each 0.5 mm of the way."""
        points = []
        for q in self.q:
            point = forward(arm_model("UR5e"), q).translation
            if not points or math.dist(point, points[-1]) > 0.0005:
                points.append(point)
        return points


def distance(points, others):
    """The largest distance of a point from the line through the others."""
    starts = np.array(others[:-1])
    legs = np.diff(np.array(others), axis=0)
    lengths = np.maximum(np.sum(legs * legs, axis=1), 1e-18)
    largest = 0.0
    for point in np.array(points):
        share = np.clip(np.sum((point - starts) * legs, axis=1) / lengths, 0.0, 1.0)
        largest = max(largest, float(np.min(np.linalg.norm(starts + share[:, None] * legs - point, axis=1))))
    return largest


def run(program, tmp_path):
    """Run a program against a controller of its own: what it has printed, what was set and moved, and the way."""
    with SimulatedController("UR5e", free_host(), START, log=tmp_path / f"{program.stem}.jsonl") as simulated:
        text = (FOLDER / "scene.toml").read_text(encoding="utf-8").replace("127.0.0.1", simulated.host)
        (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
        command = [sys.executable, str(program), simulated.host]
        with Way(simulated.host) as way:
            done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout, simulated.events(), way.points()


def moves(events):
    """The moves that the controller was given."""
    return [
        (event["kind"], [round(x, 3) for x in event["target"]], event["v"], event["a"])
        for event in events
        if event["event"] == "motion" and event["kind"] in ("JointLine", "ToolLine")
    ]


def compare(tmp_path) -> float:
    """Run both programs, see that they say and do the same, and return how far their ways are apart [m]."""
    (told, events, way), (guarded_told, guarded_events, guarded_way) = (run(p, tmp_path) for p in (PROGRAM, GUARDED))
    assert guarded_told == told
    assert "way points [0, 1, 2]" in told
    assert moves(guarded_events) == moves(events)
    outputs = [[e["outputs"] for e in log if e["event"] == "digital"] for log in (events, guarded_events)]
    assert outputs[0] == outputs[1] == [4, 0]
    assert sum(map(math.dist, way, way[1:])) > 0.5, "half a metre and more"
    return max(distance(way, guarded_way), distance(guarded_way, way))


def test_both_drive_the_same_way(tmp_path) -> None:
    # speedL ends when the program notices: one that this computer holds up meanwhile goes on by 25 mm in .1 s
    ways = (compare(tmp_path) for _ in range(5))
    assert any(apart < 0.01 for apart in ways), "5 times apart by a centimetre and more"
