"""A motion away that a force resists beside the skin: only the currents of the motors show it."""

import math

import pytest

from coneskin.robot.arm.models import UR_CURRENTS
from coneskin.robot.driver.values import ControllerState
from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.joint_current import (
    OutsideTorque,
    ResistanceMonitor,
    _push_torque,
)
from coneskin.robot.reaction.types import ContactOnLink, Reaction
from tests.support.guard_rig import CONE, LINK, MODEL, START_Q, GuardRig, touch

ZEROS = (0.0,) * 6
Q = tuple(START_Q)
TOUCH = ContactOnLink(LINK, CONE.point(0.13, 1.57), CONE.normal(1.57), 0.6, True, 0.1, 1)


def state(torque, target=ZEROS):
    """A state whose motors hold a torque from outside [N m]."""
    current = None
    if target is not None:
        current = tuple(a - t / k for a, t, k in zip(target, torque, UR_CURRENTS.torque_per_ampere, strict=True))
    return ControllerState(0.0, 0.0, Q, ZEROS, True, False, True, current, target)


def push(force, contact=TOUCH):
    return [force * turn for turn in _push_torque(MODEL, Q, contact)]


class Monitored:
    """An arm that learns while nothing touches, and is then watched."""

    def __init__(self, *usual, yields=False):
        self.torque = OutsideTorque(MODEL)
        for torque in usual or [ZEROS]:
            self.torque.feed(state(torque), True)
        self.monitor = ResistanceMonitor(MODEL, self.torque, yields)

    def told(self, *torques):
        found = []
        for torque in torques:
            self.torque.feed(state(torque), False)
            found.append(bool(self.monitor.resistance(Q, [TOUCH])))
        return found


def one(joint, torque):
    return [torque if i == joint else 0.0 for i in range(6)]


@pytest.mark.parametrize("joint", range(3, 6))
def test_what_no_touch_explains_counts_after_a_few_samples_and_below_its_limit_never(joint):
    arm = Monitored()
    assert not any(arm.told(ZEROS, *[one(joint, 1.4)] * 50, *[one(joint, -1.4)] * 50))
    assert arm.told(one(joint, 1.6), one(joint, 1.6), ZEROS, *[one(joint, -1.6)] * 3) == [False] * 5 + [True]


@pytest.mark.parametrize("yields", [False, True])
def test_a_touch_explains_its_own_force_and_no_other(yields):
    arm = Monitored(yields=yields)
    assert not any(arm.told(*[push(200.0)] * 5, *[push(200.0 - 4.0 * k) for k in range(50)]))
    assert any(arm.told(*[push(-25.0)] * 5)), "a body behind presses against the touch"


def test_a_push_that_grows_is_what_giving_way_follows_and_ends_a_retreat():
    growing = [push(5.0 * k) for k in range(1, 40)]
    assert not any(Monitored(yields=True).told(*growing))
    assert any(Monitored().told(*growing))


def test_friction_is_learned_before_and_never_excuses_more_than_the_most():
    usual = [one(1, 6.0 * math.sin(0.3 * k)) for k in range(400)]
    arm = Monitored(*usual)
    assert not any(arm.told(ZEROS, *usual[:50]))
    assert any(arm.told(*[one(1, UR_CURRENTS.max_unexplained[1] + 1.0)] * 5))
    calm = Monitored(ZEROS, one(1, 0.6)).torque  # three times the spread, and learned with 1 s
    assert calm.tolerance[1] == pytest.approx(UR_CURRENTS.min_unexplained[1] + 3.0 * 0.6)
    calm.feed(state(ZEROS), False)
    assert calm.now == pytest.approx(one(1, -0.6 / 500.0))
    wild = Monitored(*[one(1, 100.0 * math.sin(0.3 * k)) for k in range(400)])
    assert wild.torque.tolerance == (3.0, UR_CURRENTS.max_unexplained[1], 3.0, 1.5, 1.5, 1.5)


def test_a_payload_that_was_set_wrong_is_no_push():
    usual = one(1, 15.0)
    arm = Monitored(*[usual] * 3)
    assert not any(arm.told(*[usual] * 50))
    assert arm.torque.now == pytest.approx(ZEROS)


@pytest.mark.promise("P32")
def test_without_currents_nothing_moves_away():
    arm = Monitored()
    arm.torque.feed(state(ZEROS, None), False)
    assert "sends no motor currents" in arm.monitor.resistance(Q, [TOUCH])


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
    assert rig.event("retreated").details["why"].endswith(" N m more than its touches explain: something resists it")
    assert rig.core.phase is Phase.LATCHED
    assert way < 0.006
