"""Slow is slow at the surface: how far it moves into what touches it, beside a bare stop; receding goes on."""

import math
from dataclasses import replace

import pytest

from coneskin.robot.arm.kinematics import link_pose
from coneskin.robot.arm.models import arm_model
from coneskin.robot.guard.phase import Phase
from coneskin.robot.reaction.contact_supervision import ContactApproach
from coneskin.robot.reaction.rules import Rule
from coneskin.robot.reaction.types import ContactOnLink, Reaction
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from tests.support.guard_rig import GuardRig, touch

from .test_resisted_retreat import HAND, PHI, collide, excess

SLOW = Reaction("slow", time_budget=5.0)
FOREARM = ContactOnLink(3, (0.2, 0.0, 0.05), (0.0, 0.0, 1.0), 0.8, True, 0.1, 1)


@pytest.mark.promise("P07")
@pytest.mark.parametrize("heeds", [True, False])
def test_an_arm_that_moves_into_the_touch_is_stopped_as_by_a_stop(heeds):
    """587 mm before, where the slider was not heeded and the joints were slower than 0.25 rad/s."""
    hand = replace(HAND, hardest=200.0)
    rig = collide(SLOW, hand, heeds=heeds)
    assert rig.core.phase is Phase.LATCHED
    assert excess(rig, hand) == 0.0
    assert not any(event.name == "speed_reduced" for event in rig.events)


@pytest.mark.long
def test_what_moves_into_the_touch_slowly_may_do_so_by_a_little():
    """0.03 rad/s of the base, 13 mm/s: a stop takes it 0.02 mm into the touch; the slow arm is stopped at 0.5 mm."""
    rig = GuardRig(touch(0.5, 5.0, phi=PHI), reaction=SLOW, speed=0.03).run(2.0)
    slow, stop = rig.event("speed_reduced"), rig.event("stopping")
    assert "while slow, the surface would move 0.5 mm into the touch" in stop.details["why"]
    assert stop.time > slow.time + 0.02


@pytest.mark.promise("P07")
def test_a_slow_arm_that_something_holds_is_stopped():
    """A wall that stops the surface lets the setpoints go on: 540 N more than by a stop (bench `collision`, 514)."""
    rig = GuardRig(touch(0.5, 5.0, phi=(PHI + math.pi) % (2.0 * math.pi)), reaction=SLOW, speed=0.3).run(0.7)
    assert rig.core.phase is Phase.SLOWED
    rig.arm.current = [0.0, 1.9, 0.0, 0.0, 0.0, 0.0]
    rig.run(0.1)
    assert rig.core.phase is Phase.SLOWED
    rig.arm.current = [0.0, 2.1, 0.0, 0.0, 0.0, 0.0]
    rig.run(0.1)
    assert rig.event("stopping").details["why"] == (
        "while slow, joint 2 takes 25.2 N m more than its touches explain: something resists it"
    )


@pytest.mark.long
def test_an_arm_that_recedes_from_the_touch_goes_on():
    rig = GuardRig(touch(0.5, 1.0, phi=(PHI + math.pi) % (2.0 * math.pi)), reaction=SLOW, speed=0.3).run(2.0)
    assert "stopping" not in rig.names
    assert "resumed" in rig.names


@pytest.mark.long
@pytest.mark.promise("P03")
def test_level_rules_see_a_press_that_grows_slowly():
    """Events come in steps of a tenth of the level: from 2 N, 0.81, to 200 N, 0.91, there is none."""
    firm = Rule(Reaction("stop"), level_above=0.82)
    press = ScriptedTouch(0.5, 9.0, 0.13, 1.57, force=200.0, rise=4.0)
    rig = GuardRig(press, reaction=replace(SLOW, press=0.1, time_budget=9.0), rules=(firm,), speed=0.01).run(2.0)
    named = rig.event("stopping").details
    assert named["why"] == "touch"
    assert 0.82 < named["contact"]["level"] < 0.83


def test_the_speed_of_the_surface_counts_and_not_that_of_the_joint():
    """0.24 rad/s of the base of a UR10e: 0.25 m/s and more at its forearm, which is not slow."""
    q, qd = (0.0, -0.5, 0.3, 0.0, 0.0, 0.0), (0.24, 0.0, 0.0, 0.0, 0.0, 0.0)
    approach = ContactApproach(arm_model("UR10e"), q, qd, 10.0, 0.001)
    approach.update(q, qd, [FOREARM])
    assert 0.15 < approach.speed[0] < 0.35
    approach.update(q, qd, [replace(FOREARM, location_valid=False)])
    assert approach.speed[0] > 0.24  # any point, where the place is not certain


def test_where_the_place_is_not_certain_every_motion_counts():
    q, qd = (0.0, -0.5, 0.3, 0.0, 0.0, 0.0), (-0.2, 0.0, 0.0, 0.0, 0.0, 0.0)  # away from the place that is supposed
    later = (-0.01, *q[1:])
    vague = replace(FOREARM, location_valid=False)
    approach = ContactApproach(arm_model("UR10e"), q, qd, 10.0, 0.001)
    approach.update(q, qd, [vague])
    assert not approach.exceeded[0]
    approach.update(later, qd, [vague])
    assert approach.exceeded[0] == 1


def test_a_place_that_comes_late_counts_from_the_beginning_of_the_touch():
    q, still = (0.0, -0.5, 0.3, 0.0, 0.0, 0.0), (0.0,) * 6
    per_radian = way_into(FOREARM, q, (1e-6, *q[1:])) / 1e-6
    for way, exceeded in ((0.0004, 0), (0.0006, 1)):
        approach = ContactApproach(arm_model("UR10e"), q, still, 10.0, 0.0005)
        vague = replace(FOREARM, location_valid=False)
        approach.update(q, still, [vague])
        approach.update((0.5 * way / per_radian, *q[1:]), still, [vague])
        assert not approach.exceeded[0]
        approach.update((way / per_radian, *q[1:]), still, [FOREARM])
        assert approach.exceeded[0] == exceeded
    assert approach.exceeded[1] == pytest.approx(0.0006, rel=0.01)


def test_the_way_of_a_stop_is_counted():
    """v s / (2 a), of a joint of 0.1 rad/s and 10 rad/s2."""
    q = (0.0, -0.5, 0.3, 0.0, 0.0, 0.0)
    per_radian = way_into(FOREARM, q, (1e-6, *q[1:])) / 1e-6
    for room, exceeded in ((1.01, 0), (0.99, 1)):
        approach = ContactApproach(arm_model("UR10e"), q, (0.1,) + (0.0,) * 5, 10.0, room * per_radian * 0.1**2 / 20.0)
        approach.update(q, (0.1,) + (0.0,) * 5, [FOREARM])
        assert approach.exceeded[0] == exceeded


def way_into(contact, q, later):
    """Return how far the surface moves towards a touch between two joint positions [m]."""
    model = arm_model("UR10e")
    before, after = link_pose(model, q, contact.link), link_pose(model, later, contact.link)
    change = [b - a for a, b in zip(before.apply(contact.point), after.apply(contact.point), strict=True)]
    return sum(n * c for n, c in zip(before.rotate(contact.normal), change, strict=True))


@pytest.mark.parametrize(("on", "off"), [(0.02, 0.01), pytest.param(0.05, 0.03, marks=pytest.mark.long)])
@pytest.mark.long
def test_a_touch_that_flickers_is_pressed_no_farther_than_a_steady_one(on, off):
    """4.5 to 9 mm before, each flicker being a new touch with a way of its own."""
    flicker = [touch(1.0 + (on + off) * n, 1.0 + (on + off) * n + on) for n in range(int(1.0 / (on + off)))]
    rig = GuardRig(*flicker, reaction=Reaction("slow"), speed=0.08, follows=True).run(1.0)
    at, normal = rig.point(), rig.normal()
    rig.run(1.0)
    assert sum((a - b) * n for a, b, n in zip(rig.point(), at, normal, strict=True)) < 0.001
    assert rig.core.phase is Phase.LATCHED


def test_ways_into_touches_of_one_link_add_up_whether_their_places_were_certain_or_not():
    """Blind flickers between certain ones do not begin anew, and another link's touch has a way of its own."""
    model = arm_model("UR5e")
    q, qd = (0.0, -1.2, 1.2, 0.0, 0.0, 0.0), (0.02, 0.0, 0.0, 0.0, 0.0, 0.0)
    approach = ContactApproach(model, q, qd, 10.0, 1.0)
    for number in range(1, 40):
        contact = replace(FOREARM, number=number, location_valid=number % 2 == 0)
        q = (q[0] + 1e-3, *q[1:])
        approach.update(q, qd, [contact])
    blind = approach._touches[39].blind
    other = replace(FOREARM, link=2, number=100, location_valid=False)
    approach.update((q[0] + 1e-3, *q[1:]), qd, [other])
    assert blind > 15.0 * approach._touches[100].blind > 0.0
