"""The fault campaign, every eleventh kind once: bench `faults` is the whole of it, at random times."""

import json
import subprocess
import sys

import pytest

from tests.support.paths import ROOT

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")


def campaign(*options):
    command = [sys.executable, "-m", "bench", "faults", "--times", "1", "--json", *options]
    done = subprocess.run(command, capture_output=True, text=True, timeout=500, cwd=ROOT)
    return done, [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]


@pytest.mark.long
def test_after_a_fault_of_each_family_the_arm_stands():
    """The budgets have 2 s for a machine that runs other things too: the arm would need 3 s to its goal.

    A kind that fails is tried again alone, because such a machine may also hold up the skin that was to fail later.
    """
    done, lines = campaign("--quick", "--every", "11", "--parallel", "2", "--slack-ms", "2000")
    assert len({line["kind"] for line in lines}) >= 12, done.stdout + done.stderr
    assert {line["control"] for line in lines} == {"internal", "external"}
    for line in lines:
        if line["failed"]:
            again, _ = campaign("--kinds", line["kind"], "--control", line["control"], "--slack-ms", "2000")
            assert again.returncode == 0, f"{line['kind']}: {line['failures']}, then {again.stdout}"


@pytest.mark.long
def test_the_campaign_can_fail():
    """An arm that stops, but too late, is a failure: no budget is met a second before the fault."""
    done, lines = campaign("--kinds", "skin silent for", "--control", "external", "--slack-ms", "-2000")
    assert done.returncode == 1
    (line,) = lines
    assert line["failed"] == 1
    assert "it took" in line["failures"][0]
