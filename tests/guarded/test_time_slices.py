"""The processes of a guard are let in soon: every thread of theirs has short time slices."""

import re
from pathlib import Path

import pytest

from coneskin.robot.sim.process import SimulatedController, free_host
from coneskin.session.session import guard
from coneskin.testing.scenes import START
from tests.core.test_time_slice import told_by_kernel

from .guarded_session import scene_for


@told_by_kernel
@pytest.mark.parametrize(("control", "names"), [("internal", {"guard", "driver"}), ("external", {"guard", "watchdog"})])
def test_every_thread_of_a_guard_has_short_slices(control, names):
    with (
        SimulatedController(model="UR5e", host=free_host(), start_q=START) as controller,
        guard(scene_for(controller, control=control)) as session,
    ):
        children = session._processes.children
        assert names <= set(children)
        for name in names:
            tasks = list(Path(f"/proc/{children[name].pid}/task").iterdir())
            slices = {int(re.search(r"se\.slice *: *(\d+)", (task / "sched").read_text())[1]) for task in tasks}
            assert slices == {100_000}, name
