"""The script that measures a controller, on the simulated one: what coneskin assumes holds there, and it can fail."""

import json
import subprocess
import sys

import pytest

from coneskin.robot.sim.process import SimulatedController, free_host
from tests.support.paths import ROOT

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the simulated controller needs several addresses")
SCRIPT = ROOT / "scripts" / "measure_controller.py"


def measured(simulated, *options, answer=""):
    return subprocess.run(
        [sys.executable, str(SCRIPT), simulated.host, *options],
        input=answer,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.promise("P69")
@pytest.mark.long
def test_every_assumption_is_measured_and_a_slow_controller_is_found():
    with SimulatedController("UR5e", free_host(), start_delay=0.06) as simulated:
        done = measured(simulated, "--yes", "--json")
        found = {one["name"]: one for one in json.loads(done.stdout)}
        assert len(found) == 10, done.stderr
        assert not found["a program starts"]["holds"]  # 60 ms
        assert done.returncode == 1
        for name in (
            "a secondary program runs beside",
            "the watchdog ends a program",
            "the speed slider at 0",
            "protective_stop() in a secondary program",
        ):
            assert found[name]["holds"], found[name]
        state = simulated.state()
        assert state["safety"] == "PROTECTIVE_STOP"
        assert abs(state["q"][5]) < 0.31
        assert state["slider"] == 1.0


def test_it_asks_before_it_moves():
    with SimulatedController("UR5e", free_host()) as simulated:
        before = simulated.state()["q"]
        assert measured(simulated, answer="no\n").returncode == 1
        assert simulated.state()["q"] == before
