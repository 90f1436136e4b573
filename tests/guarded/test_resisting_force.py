"""A force beside the skin resists a retreat: the motor currents of the simulated controller show it to the guard."""

import sys
from itertools import count

import pytest

from coneskin.core.errors import Collision
from coneskin.runs.replay.run import read_run
from coneskin.session.session import guard
from tests.support.scenes import START

from .guarded_session import DEADLINE, run_until_moving, scene_for, until_undisturbed

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="the virtual skin needs a pseudo-terminal")
pytest.importorskip("rtde_control", reason="the ur_rtde wheel is not installed (there is none for this Python)")

from coneskin.robot.sim.process import SimulatedController, free_host  # noqa: E402

SLOWLY = {"distance_mm = 30": "distance_mm = 90\nspeed_mm_s = 40"}


@pytest.mark.promise("P32")
@pytest.mark.long
def test_a_force_beside_the_skin_ends_the_retreat(tmp_path):
    paths = (tmp_path / f"run{number}.rec" for number in count())

    def attempt():
        path = next(paths)
        with SimulatedController(model="UR5e", host=free_host(), start_q=START) as controller:

            def resist(event):
                if event.name == "retreating":
                    controller.call("resist 0 4 0 0 0 0")

            with guard(scene_for(controller, SLOWLY), recording=path, on_event=resist) as session:
                thread, raised = run_until_moving(controller, session)
                session.touch(0.13, 1.55, duration=0.2)
                thread.join(DEADLINE)
        assert isinstance(raised[0], Collision)
        run = read_run(path)
        assert run.replay().same
        return run.events

    (over,) = (event.details for event in until_undisturbed(attempt) if event.name == "retreated")
    assert over["complete"] is False
    assert over["why"] == "joint 2 takes 48.0 N m more than its touches explain: something resists it"
