"""The fault campaign, each kind once: bench/faults.py is the long one, at a hundred random times."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

CAMPAIGN = Path(__file__).parents[2] / "bench" / "faults.py"


def campaign(*options):
    command = [sys.executable, str(CAMPAIGN), "--times", "1", "--json", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    return done, [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


def test_after_every_kind_of_fault_the_arm_stands():
    """The budgets have 2 s for a machine that runs other things too: the arm would need 3 s to its goal."""
    done, lines = campaign("--quick", "--parallel", "3", "--slack-ms", "2000")
    assert {line["kind"]: line["failures"] for line in lines if line["failed"]} == {}
    assert done.returncode == 0, done.stdout + done.stderr
    assert len({line["kind"] for line in lines}) >= 30
    assert {line["control"] for line in lines} == {"owner", "foreign"}


def test_the_campaign_can_fail():
    """An arm that stops, but too late, is a failure: no budget is met a second before the fault."""
    done, lines = campaign("--kinds", "skin silent for", "--control", "foreign", "--slack-ms", "-2000")
    assert done.returncode == 1
    (line,) = lines
    assert line["failed"] == 1
    assert "it took" in line["failures"][0]
