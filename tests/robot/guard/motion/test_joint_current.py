"""A motion away that a force resists beside the skin: only the currents of the motors show it."""

import math

import pytest

from coneskin.robot.driver.values import ControllerState
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.joint_current import MAX_RISE, JointCurrentMonitor
from coneskin.robot.reaction.types import Reaction
from tests.support.guard_rig import GuardRig, touch

ZEROS = (0.0,) * 6


def state(current, target=ZEROS):
    return ControllerState(0.0, 0.0, ZEROS, ZEROS, True, False, True, current, target)


def off(joint, current):
    return state(tuple(current if i == joint else 0.0 for i in range(6)))


def told(monitor, *states):
    return [bool(monitor.resistance(each)) for each in states]


@pytest.mark.parametrize("joint", range(6))
def test_a_rise_counts_after_a_few_samples_and_below_its_limit_never(joint):
    above, below = MAX_RISE[joint] + 0.1, MAX_RISE[joint] - 0.1
    monitor = JointCurrentMonitor()
    assert not any(told(monitor, off(joint, 0.0), *[off(joint, below)] * 50, *[off(joint, -below)] * 50))
    assert told(monitor, *[off(joint, above)] * 4, off(joint, 0.0), *[off(joint, -above)] * 5) == [False] * 9 + [True]


def test_a_push_that_fades_is_none_and_one_from_the_other_side_is():
    monitor = JointCurrentMonitor()
    assert not any(told(monitor, *[off(0, 5.0)] * 20, *[off(0, 5.0 - 0.1 * k) for k in range(50)]))
    assert any(told(monitor, *[off(0, -2.5)] * 5))


def test_what_the_controller_expects_is_no_resistance():
    monitor = JointCurrentMonitor()
    assert not any(told(monitor, *[state((0.1 * k,) * 6, (0.1 * k,) * 6) for k in range(100)]))
    assert not any(told(monitor, *[state(None, None)] * 10))


def resisted(joint=1, current=3.0):
    """Let a force come while the arm moves away."""
    rig = GuardRig(touch(0.5), reaction=Reaction("retreat"), speed=0.5).run(0.5)
    while "retreating" not in rig.names:
        rig.run(0.002)
    rig.run(0.06)
    assert rig.core.phase is Phase.RETREATING
    rig.arm.current[joint] = current
    began, place = rig.now, rig.point()
    while rig.core.phase is Phase.RETREATING:
        rig.run(0.001)
    assert rig.now - began < 0.015
    return rig.run(1.0), math.dist(place, rig.point())


@pytest.mark.promise("P32")
def test_a_retreat_that_a_force_resists_beside_the_skin_ends_at_once():
    rig, way = resisted()
    assert rig.event("retreated").details["why"] == "joint 2 takes 3.0 A more than expected: something resists it"
    assert rig.core.phase is Phase.LATCHED
    assert way < 0.006


def test_a_current_that_the_motion_needs_does_not_end_it():
    rig = GuardRig(touch(0.5), reaction=Reaction("retreat", distance=0.03), speed=0.5).run(0.5)
    rig.arm.current = [1.5, -1.5, 1.5, 0.8, -0.8, 0.8]
    assert rig.run(1.0).event("retreated").details["complete"] is True
