"""Every demo runs, as a person starts it, and what it prints is right."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.paths import ROOT

DEMOS = ROOT / "demos"
ARGUMENTS = {"04_guard_a_program.py": ["127.0.0.44" if sys.platform.startswith("linux") else "127.0.0.1"]}


def play(name: str, attempts: int = 1) -> str:
    """Run a demo and return what it prints; it must end well and complain of nothing.

    Args:
        attempts: how often it may end because this computer is too busy for a guard, as its last words are then.
    """
    for _ in range(attempts):
        done = subprocess.run(
            [sys.executable, "-W", "error", str(DEMOS / name), *ARGUMENTS.get(name, [])],
            capture_output=True,
            text=True,
            timeout=300,
        )
        if "busy" not in done.stderr:
            break
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_the_demos_are_numbered_and_all_are_tested_here() -> None:
    names = sorted(path.name for path in DEMOS.glob("*.py"))
    assert [name[:3] for name in names] == [f"{n:02}_" for n in range(1, len(names) + 1)]
    source = Path(__file__).read_text(encoding="utf-8")
    assert all(f'play("{name}"' in source for name in names)


def test_unroll() -> None:
    out = play("01_unroll.py")
    # by hand: s = sqrt(30^2 + 150^2) = 152.971 mm, r1 = 40 s/30, theta0 = 270 deg * 30/s
    assert "r1 203.961 mm, r2 356.931 mm, theta0 52.951 deg" in out
    assert "radii 40.000 and 70.000 mm" in out


def test_bytes_to_contact() -> None:
    out = play("02_bytes_to_contact.py")
    match = re.search(r"u = ([\d.]+) mm, phi = ([\d.]+) deg, certain: True", out)
    assert match
    assert float(match[1]) == pytest.approx(250.0, abs=0.5)  # one count of 12 bits is 0.13 mm, its noise 0.7 counts
    assert float(match[2]) == pytest.approx(60.0, abs=0.5)
    assert re.search(r"on the wire: c53a0124( [0-9a-f]{8}){8}\n", out)  # sync, version 1, 36 bytes


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals on Windows")
def test_virtual_skin() -> None:
    out = play("03_virtual_skin.py")
    kinds = re.findall(r" s  (\w+)", out)
    assert [kind for kind in kinds if kind != "SkinFault"] == ["TouchBegan", "TouchEnded"]  # a stall adds a fault
    assert "at u = 200 mm" in out
    assert "stream ended: SkinConnectionError" in out
    frames, missing = map(int, re.findall(r"(\d+) (?:frames|missing)", out))
    assert frames + missing <= 600  # 0.6 s at 1000 Hz
    assert missing >= (frames + missing) // 97  # each 97th; a held-up skin sends fewer than 600


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals on Windows")
def test_guard_a_program() -> None:
    pytest.importorskip("rtde_control", reason="ur-rtde is not installed")
    for _ in range(10):
        out = play("04_guard_a_program.py", attempts=5)
        if "retreating" in out:  # else what the arm would be moved away by came too late: this computer is busy
            break
    place = re.match(r"Collision: sensor 0/0 on the forearm was touched at u = ([\d.]+) mm, phi = ([\d.]+) deg", out)
    assert place
    assert float(place[1]) == pytest.approx(130.0, abs=3.0)  # some counts of noise, and the area of the contact
    assert float(place[2]) == pytest.approx(90.0, abs=3.0)
    events = re.search(r"events: (.*)", out)
    assert events
    names = events[1].split(", ")
    milestones = [
        "activated",
        "stopping",
        "contact",
        "decelerating",
        "standstill",
        "retreating",
        "retreated",
        "latched",
    ]
    assert [name for name in dict.fromkeys(names) if name in milestones] == milestones
    assert out.endswith("after the reset: back home\n")


def test_replay_as_test() -> None:
    out = play("05_replay_as_test.py")
    assert "touch on sensor 0/0 (tube) at u = 200.0 mm" in out
    assert out.endswith("the same events, bit by bit\n")


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals on Windows")
def test_runs_as_tests() -> None:
    out = play("06_runs_as_tests.py")
    assert re.search(r"collision\.rec: \d+ kB, from", out)
    assert out.count("1 passed") == 3
    assert re.search(r"contact 1: u 198\.\d+ -> 200\.\d+ mm", out)
    assert out.index("1 failed") < out.index("golden events written")


def test_own_source() -> None:
    out = play("07_own_source.py").splitlines()
    assert out[0].startswith("TouchBegan: u = 250 mm, phi = 60 deg")
    assert "TouchMoved: u = 250 mm, phi = 60 deg, certain: True" in out
    assert out[-1].startswith("TouchEnded: ")
