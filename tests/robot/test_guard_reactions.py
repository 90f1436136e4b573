"""Reactions by rule, a foreign arm, fallbacks, lateness: on a virtual skin and a mocked arm, in virtual time."""

import math

import pytest

from coneskin.errors import RobotConnectionError
from coneskin.robot.commands import Reaction
from coneskin.robot.follower import FollowerProgram, Steer
from coneskin.robot.journal import Kind
from coneskin.robot.owner_messages import Halt, Speed, Stop
from coneskin.robot.phase import Phase
from coneskin.robot.rules import Rule
from coneskin.robot.slowing import Slider
from coneskin.robot.speed_slider import decode_fraction
from coneskin.robot.stop_watch import Use, Way
from coneskin.robot.table import Table
from coneskin.skin.recording import Block
from coneskin.skin.scripted_touch import ScriptedTouch

from .rig import LINK, MODEL, SLIDER, Rig, make_core, touch

SLOW = Reaction(kind="slow", slow_to=0.2, time_budget=1.0)


def progress(before, after, normal):
    return sum((b - a) * -n for a, b, n in zip(before, after, normal, strict=True))


# ---- slow


def test_slow_while_it_is_touched_then_as_before():
    rig = Rig(touch(0.5, 0.8), reaction=SLOW, speed=1.0).run(0.45)
    assert rig.arm.qd[0] == pytest.approx(1.0)
    rig.run(0.4)
    assert rig.core.phase is Phase.SLOWED
    assert rig.arm.qd[0] == pytest.approx(0.2)
    rig.run(0.9)
    assert rig.core.phase is Phase.ARMED
    assert rig.arm.qd[0] == pytest.approx(1.0)
    assert [command for command in rig.arm.commands if isinstance(command, Slider)] == [Slider(0.2), Slider(1.0)]
    assert rig.names == ["armed", "slowing", "contact", "contact_placed", "touch_ended", "resumed"]
    assert not any(isinstance(command, Stop | Way) for command in rig.arm.commands)


def test_a_slider_that_was_low_already_is_not_raised():
    rig = Rig(touch(0.5, 0.8), reaction=SLOW, speed=1.0)
    rig.arm.slider = 0.15
    rig.run(1.6)
    assert [command.fraction for command in rig.arm.commands if isinstance(command, Slider)] == [0.15, 0.15]


def test_an_arm_that_does_not_become_slower_is_stopped():
    rig = Rig(touch(0.5, 0.9), reaction=SLOW, speed=1.0)
    rig.arm.heeds = False
    rig.run(1.5)
    assert rig.core.phase is Phase.LATCHED
    assert "did not become slower" in rig.event("stopping").details["why"]
    # 1 rad/s at 10 rad/s2, and four times 25 ms
    assert rig.event("stopping").time - rig.event("slowing").time == pytest.approx(0.2, abs=0.002)
    assert rig.arm.commands[-1] == Slider(1.0)  # where it was: the next program shall not be slow without a reason


def test_a_touch_that_lasts_too_long_stops():
    rig = Rig(touch(0.5), reaction=SLOW, speed=1.0).run(2.0)
    assert rig.core.phase is Phase.LATCHED
    assert "lasts too long" in rig.event("stopping").details["why"]
    assert not any(isinstance(command, Speed) for command in rig.arm.commands)


def test_a_fault_while_slow_stops():
    rig = Rig(touch(0.5), reaction=SLOW, speed=1.0).run(0.6)
    assert rig.core.phase is Phase.SLOWED
    rig.mute_skin = True
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED


def test_a_firmer_touch_while_slow_gets_its_own_reaction():
    light = Reaction(kind="slow", time_budget=5.0)
    firm = Rule(Reaction(distance=0.03), level_above=0.5)
    rig = Rig(touch(0.5, 1.5), reaction=light, rules=(firm,), speed=1.0).run(2.5)
    assert rig.names[:2] == ["armed", "stopping"] or rig.names[:3] == ["armed", "slowing", "contact"]
    assert "retreated" in rig.names
    assert rig.core.phase is Phase.LATCHED


def test_without_a_slider_there_is_no_arming():
    rig = Rig(reaction=SLOW)
    core = make_core(list(rig.skin.sensors), SLOW)
    assert any("speed slider" in line for line in core.unsound(0.0))
    rig.run(0.5)
    rig.feed(Kind.LOST, b"slider\nthe controller has closed the connection of its speed slider")
    rig.run(0.3)
    assert rig.core.phase is Phase.LATCHED


# ---- rules


def test_the_first_rule_that_fits_is_the_reaction():
    rules = (Rule(Reaction(kind="stop"), link=1), Rule(Reaction(kind="stop"), speed_above=0.5, link=LINK))
    fast = Rig(touch(0.5, 0.7), rules=rules, speed=1.0).run(1.5)
    assert "retreating" not in fast.names
    slow = Rig(touch(0.5, 0.7), rules=rules, speed=0.3).run(1.5)
    assert "retreating" in slow.names


def test_how_firm_a_touch_is_shows_while_the_arm_stops():
    """In the frame in which it begins it is light; the rule for firm ones is met some frames later, in time."""
    rule = Rule(Reaction(kind="stop"), level_above=0.3)
    rig = Rig(touch(0.5, 0.9), rules=(rule,), speed=1.0).run(1.5)
    assert "retreating" not in rig.names
    assert rig.core.phase is Phase.LATCHED


# ---- comply


def comply(**settings):
    return Reaction(kind="comply", speed=0.1, distance=0.04, **settings)


@pytest.mark.parametrize("foreign", [False, True])
def test_it_gives_way_while_it_is_pushed_and_stops_with_the_push(foreign):
    rig = Rig(touch(0.5, 1.0), reaction=comply(), speed=1.0, foreign=foreign).run(0.7)
    assert rig.core.phase is Phase.RETREATING
    before, normal = rig.point(), rig.normal()
    rig.run(0.2)
    assert 0.005 < progress(before, rig.point(), normal) < 0.021  # at 0.1 m/s, from a standstill
    rig.run(1.0)
    assert rig.core.phase is Phase.LATCHED
    assert rig.event("retreating").details == {"how": "push"}
    assert rig.event("retreated").details["why"] == "the touch is over"
    assert rig.event("retreated").time - 100.0 == pytest.approx(1.0, abs=0.01)
    assert max(map(abs, rig.arm.qd)) < 0.01


def test_it_gives_way_no_farther_than_its_distance():
    rig = Rig(touch(0.5), reaction=comply(), speed=1.0).run(3.0)
    assert rig.core.phase is Phase.LATCHED
    assert rig.event("retreated").details["why"] == "the distance is made"
    assert rig.event("retreated").details["progress"] == pytest.approx(0.04, abs=0.001)


def test_no_longer_than_its_time():
    rig = Rig(touch(0.5), reaction=comply(time_budget=0.1), speed=1.0).run(2.0)
    assert "the time of 0.1 s is over" in rig.event("retreated").details["why"]


def test_a_harder_rule_ends_it():
    rules = (Rule(Reaction(kind="stop"), level_above=0.99),)
    rig = Rig(touch(0.5), reaction=comply(), rules=rules, speed=1.0).run(0.7)
    assert rig.core.phase is Phase.RETREATING
    rig.core._arm.touch(rig.now, LINK, 1.0, False, [])
    assert rig.core.phase is Phase.HALTING


# ---- foreign


def test_a_foreign_arm_is_stopped_by_script_and_follows():
    rig = Rig(touch(0.5, 0.7), foreign=True, speed=1.0).run(0.45)
    assert rig.core.phase is Phase.ARMED
    assert rig.arm.commands == []  # nothing is sent before it is needed
    rig.run(0.052)
    before, normal = rig.point(), rig.normal()
    rig.run(2.0)
    kinds = [command if isinstance(command, Way) else type(command) for command in rig.arm.commands]
    assert kinds[:4] == [Way.SCRIPT, Steer, FollowerProgram, Steer]  # there are speeds before the program starts
    assert kinds[-3:] == [Steer, Way.SCRIPT, Steer]
    assert rig.arm.commands[-1].token == 0  # the speeds count no more, even if the stop were lost
    # 0.5 mm left for braking; ``before`` is one cycle later at up to 0.3 m/s
    assert progress(before, rig.point(), normal) == pytest.approx(0.050, abs=0.002)
    assert rig.event("retreated").details["complete"] is True
    assert rig.core.phase is Phase.LATCHED


def test_a_program_that_does_not_start_is_not_waited_for():
    rig = Rig(touch(0.5, 0.7), foreign=True, speed=1.0)
    take = rig.arm.take
    rig.arm.take = lambda command: None if isinstance(command, FollowerProgram) else take(command)
    rig.run(0.5)
    rig.arm.runtime_state = 1
    rig.run(2.0)
    assert rig.core.phase is Phase.LATCHED
    assert rig.event("retreated").details["why"] == "its program does not run on the controller"
    assert rig.event("retreated").details["complete"] is False


@pytest.mark.parametrize("foreign", [False, True])
def test_an_arm_that_something_else_moves_is_not_left_to_it(foreign):
    """A person starts a program while the arm moves away: it replaces ours."""
    rig = Rig(touch(0.5, 0.7), foreign=foreign, speed=1.0).run(0.75)
    assert rig.core.phase is Phase.RETREATING
    take, ignored = rig.arm.take, (Speed, Steer)
    rig.arm.take = lambda command: None if isinstance(command, ignored) else take(command)
    rig.arm.go([-0.5, 0.2, 0.0, 0.0, 0.0, 0.0], 4.0)
    rig.run(0.7)
    assert "does not move as it is told" in rig.event("retreated").details["why"]
    rig.run(0.3)
    assert rig.core.phase is Phase.LATCHED
    assert max(map(abs, rig.arm.qd)) < 0.01


def test_a_slow_arm_has_its_time_to_take_up_its_speed():
    reaction = Reaction(acceleration=0.25, speed=0.3, time_budget=10.0)
    rig = Rig(touch(0.5, 0.7), reaction=reaction, foreign=True, speed=1.0).run(5.0)
    assert rig.event("retreated").details["complete"] is True


def test_an_arm_that_its_speed_slider_slows_is_not_something_else():
    rig = Rig(touch(0.5, 0.7), reaction=Reaction(time_budget=10.0), foreign=True, speed=1.0).run(0.45)
    rig.arm.slider = 0.1
    rig.run(8.0)
    assert rig.event("retreated").details["complete"] is True


def test_a_fault_ends_a_foreign_retreat():
    rig = Rig(touch(0.5, 0.7), foreign=True, speed=1.0).run(0.75)
    assert rig.core.phase is Phase.RETREATING
    rig.mute_skin = True
    rig.run(0.5)
    assert rig.arm.commands[-2] is Way.SCRIPT
    assert rig.core.phase is Phase.LATCHED
    assert max(map(abs, rig.arm.qd)) < 0.01


def slow_first(kind="retreat", **settings):
    """Slow, but retreat or comply where the touch is firm."""
    harder = Rule(Reaction(kind=kind, **settings), level_above=0.5)
    return {"reaction": Reaction(kind="slow", slow_to=0.2), "rules": (harder,)}


@pytest.mark.parametrize("foreign", [False, True])
@pytest.mark.parametrize("speed", [0.15, 1.0])
def test_from_slow_to_retreat_the_slider_is_back_before_the_arm_moves_away(foreign, speed):
    firm = ScriptedTouch(0.5, 1.5, 0.13, 1.57, rise=0.3, force=30.0)
    rig = Rig(firm, foreign=foreign, speed=speed, **slow_first()).run(4.0)
    order = [name for name in rig.names if name in ("slowing", "stopping", "standstill", "retreating", "latched")]
    assert order == ["slowing", "stopping", "standstill", "retreating", "standstill", "latched"]
    assert rig.event("retreated").details["complete"] is True
    assert rig.arm.slider == 1.0
    assert rig.event("retreated").time - rig.event("retreating").time < 1.0  # at its own speed, not at a fifth of it
    assert "resumed" not in rig.names


def test_a_second_touch_ends_a_retreat_that_began_slow():
    firm = ScriptedTouch(0.5, 1.0, 0.13, 1.57, rise=0.3, force=30.0)
    rig = Rig(firm, speed=1.0, sensors=2, **slow_first(distance=0.3, time_budget=10.0)).run(0.9)
    assert rig.core.phase is Phase.RETREATING
    rig.core._arm.touch(rig.now, LINK, 0.2, True, [])
    assert rig.core.phase is Phase.HALTING


def test_a_slider_that_was_not_heard_for_long_is_not_known():
    rig = Rig(touch(1.5), reaction=Reaction(kind="slow", slow_to=0.5), speed=1.0).run(0.5)
    rig.feed(Kind.SLIDER, SLIDER.pack((1.0,)))
    feed = rig.feed
    rig.feed = lambda kind, payload=b"": [] if kind is Kind.SLIDER else feed(kind, payload)
    rig.run(1.5)
    assert "slowing" not in rig.names  # it might raise a slider that somebody has lowered
    assert rig.core.phase is Phase.LATCHED
    rig.feed = feed
    with pytest.raises(RobotConnectionError, match="from 0 to 1"):
        decode_fraction(SLIDER.pack((math.nan,)))


def test_a_person_who_slows_the_arm_further_is_not_overruled():
    rig = Rig(touch(0.5, 0.8), reaction=Reaction(kind="slow", slow_to=0.2), speed=1.0).run(0.7)
    rig.arm.slider = 0.05
    rig.run(2.0)
    assert "resumed" in rig.names
    assert rig.arm.slider == 0.05


def test_a_stop_just_after_it_slowed_leaves_no_slider_low():
    rig = Rig(ScriptedTouch(0.5, 1.0, 0.13, 1.57, force=1.0), speed=0.02, **slow_first("stop"))
    while "slowing" not in rig.names:
        rig.run(0.001)
    out = []
    rig.core._arm.touch(rig.now, LINK, 0.9, False, out)
    assert isinstance(out[0], Stop)
    rig.arm.take(out[0])
    rig.run(1.0)
    assert rig.core.phase is Phase.LATCHED
    assert rig.arm.slider == 1.0


@pytest.mark.parametrize("later", [0.001, 0.006, 0.02, 0.1])
def test_touched_again_as_it_goes_on_it_is_slow_again(later):
    first = Rig(touch(0.5, 1.0), reaction=Reaction(kind="slow", slow_to=0.2), speed=2.0).run(2.0)
    resumed = round(first.event("resumed").time - 100.0, 3)
    again = touch(resumed + later, resumed + 0.5)
    rig = Rig(touch(0.5, 1.0), again, reaction=Reaction(kind="slow", slow_to=0.2), speed=2.0).run(4.0)
    assert "stopping" not in rig.names
    assert rig.names.count("resumed") == 2
    assert rig.arm.slider == 1.0


def test_a_rules_deceleration_is_that_of_the_stop_in_foreign_mode_too():
    rule = Rule(Reaction(kind="stop", deceleration=20.0), speed_above=0.1)
    rig = Rig(touch(0.5), reaction=Reaction(kind="stop", deceleration=1.0), rules=(rule,), foreign=True, speed=1.0)
    rig.run(1.0)
    assert [output for output in rig.outputs if isinstance(output, Use)] == [Use(Way.SCRIPT, 20.0)]


@pytest.mark.parametrize("acceleration", [0.1, 4.0])
def test_something_faster_than_it_was_told_is_not_waited_for(acceleration):
    reaction = Reaction(acceleration=acceleration, time_budget=30.0)
    rig = Rig(touch(0.5, 0.7), reaction=reaction, foreign=True, speed=1.0).run(0.75)
    take = rig.arm.take
    rig.arm.take = lambda command: None if isinstance(command, Steer) else take(command)
    rig.arm.go([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], 20.0)
    rig.run(0.12)
    assert "does not move as it is told" in rig.event("retreated").details["why"]


@pytest.mark.parametrize(
    ("lost", "first"), [("script", Way.DASHBOARD), ("dashboard", Way.SCRIPT), ("keeper", Way.SCRIPT)]
)
def test_a_way_that_is_lost_is_not_tried(lost, first):
    rig = Rig(foreign=True, speed=1.0).run(0.5)
    rig.feed(Kind.LOST, f"{lost}\nit is gone".encode())
    rig.run(0.5)
    assert rig.arm.commands == [first]
    assert rig.core.phase is Phase.LATCHED
    rig.feed(Kind.RESET)
    assert "it is gone" in rig.event("refused").details["reasons"]


def test_with_its_own_connections_gone_at_once_the_guard_asks_the_keeper():
    """What went to the dashboard between the two is lost, and nothing says so."""
    rig = Rig(foreign=True, speed=1.0, obeys=frozenset({Way.KEEPER})).run(0.5)
    rig.feed(Kind.LOST, b"script\ngone")
    rig.feed(Kind.LOST, b"dashboard\ngone")
    rig.run(0.3)
    assert rig.arm.commands == [Way.DASHBOARD, Way.KEEPER]
    assert rig.core.phase is Phase.LATCHED


def test_with_no_way_left_it_says_that_it_waits():
    rig = Rig(foreign=True, speed=1.0).run(0.5)
    for name in ("script", "dashboard", "keeper"):
        rig.feed(Kind.LOST, f"{name}\ngone".encode())
    rig.arm.go([1.0, 0, 0, 0, 0, 0], 100.0)
    rig.run(1.0)
    assert rig.core.phase is Phase.STOPPING
    assert "standstill" not in rig.names


@pytest.mark.parametrize("foreign", [False, True])
def test_a_latched_arm_that_a_program_moves_is_stopped_again(foreign):
    rig = Rig(touch(0.5, 0.7), reaction=Reaction(kind="stop"), foreign=foreign, speed=1.0).run(1.0)
    assert rig.core.phase is Phase.LATCHED
    rig.arm.go([1.0, 0, 0, 0, 0, 0], 4.0)
    rig.run(0.02)
    assert rig.core.phase is Phase.LATCHED  # 0.05 rad/s, five samples long
    rig.run(0.5)
    assert rig.core.phase is Phase.LATCHED
    assert rig.names.count("latched") == 2
    assert max(map(abs, rig.arm.qd)) < 0.01


# ---- where no retreat along the normal is possible


def clamped(**settings):
    opposite = touch(0.51, sensor="two", phi=1.57 + math.pi)
    return Rig(touch(0.5), opposite, sensors=2, speed=1.0, **settings)


def test_back_along_the_path_only_where_the_scene_asks_and_nothing_is_pressed():
    assert "retreating" not in clamped().run(1.5).names
    pressed = clamped(reaction=Reaction(fallback="path")).run(1.5)  # one of the two is on the way
    assert "no way back: it leads towards the touch" in pressed.event("latched").details["why"]


def test_back_along_the_path_where_the_place_is_not_known():
    """The retreat is refused by the table, which stands higher than the arm; the way back is level."""
    table = Table(2.0)
    rig = Rig(touch(0.5, 0.7), reaction=Reaction(distance=0.08), table=table, speed=1.0).run(1.5)
    assert "the table at 2000 mm is in the way" in rig.event("latched").details["why"]
    back = Rig(touch(0.5, 0.7), reaction=Reaction(distance=0.08, fallback="path"), table=table, speed=1.0).run(0.49)
    was = list(back.arm.q)
    back.run(2.0)
    event = back.event("retreated").details
    assert back.event("retreating").details == {"how": "path"}
    assert event["complete"] is True
    assert back.arm.q[1:] == pytest.approx(was[1:], abs=1e-6)  # only joint 1 had moved
    # brakes from 1 rad/s at 10 rad/s2: 0.05 rad; 80 mm at the arm's reach, which bounds the way of every point
    from coneskin.robot.limits import reach

    assert was[0] + 0.05 + 0.012 - back.arm.q[0] == pytest.approx(0.079 / reach(MODEL)[0], abs=0.01)


def test_an_arm_that_stood_does_not_go_back():
    rig = Rig(touch(0.5, 0.7), reaction=Reaction(fallback="path"), table=Table(2.0)).run(1.5)
    assert "the arm stood when it was touched" in rig.event("latched").details["why"]


# ---- lateness


def late_burst(rig, seconds):
    """The guard is held up: frames and states wait, and come all at once, each kind together."""
    skin, states = [], []
    for step in range(round(1000 * seconds)):
        rig.now += 0.001
        skin.append(next(rig._packets)[1])
        if step % 2 == 0:
            states.append(rig.arm.step())
    return skin, states


def test_states_that_waited_are_no_reason_for_another_way():
    """A touch is read after 40 ms without the processor; 20 states from before the stop are read after it."""
    rig = Rig(touch(0.5, 0.7), speed=1.0).run(0.49)
    skin, states = late_burst(rig, 0.04)
    rig.feed(Kind.SKIN, b"".join(skin))
    assert isinstance(rig.arm.commands[-1], Stop)
    for state in states:
        rig.feed(Kind.ARM, state)
    rig.run(0.5)
    assert not any(isinstance(command, Way) for command in rig.arm.commands)
    assert rig.event("standstill").details["ways"] == ["owner"]


def test_a_guard_that_is_held_up_during_a_stop_looks_before_it_escalates():
    rig = Rig(touch(0.5, 0.7), speed=1.0).run(0.503)
    assert isinstance(rig.arm.commands[-1], Stop)
    skin, states = late_burst(rig, 0.04)
    for state in states:  # the loop reads them first while a stop is under way
        rig.feed(Kind.ARM, state)
    rig.feed(Kind.SKIN, b"".join(skin))
    rig.run(0.3)
    assert not any(isinstance(command, Way) for command in rig.arm.commands)


def test_a_stop_that_does_not_work_is_seen_in_late_states_too():
    rig = Rig(touch(0.5, 0.7), speed=1.0, obeys=frozenset([Way.SCRIPT])).run(0.503)
    _, states = late_burst(rig, 0.04)
    for state in states:
        rig.feed(Kind.ARM, state)
    assert rig.arm.commands[-1] is Way.SCRIPT


def test_a_controller_that_repeats_itself_is_silent():
    rig = Rig(speed=1.0).run(0.5)
    state = rig.arm.step()
    rig.mute_arm = True
    for _ in range(200):
        rig.run(0.002)
        rig.feed(Kind.ARM, state)
    assert "has sent no state for 50 ms" in rig.event("stopping").details["why"]
    assert Way.PROTECTIVE in rig.arm.commands


def test_the_wall_clock_is_no_part_of_it(monkeypatch):
    """Nothing in the guard asks for the time of day: a clock that jumps by a year changes nothing."""
    import time

    def jumped() -> float:
        raise AssertionError("the time of day was asked for")

    monkeypatch.setattr(time, "time", jumped)
    rig = Rig(touch(0.5, 0.7), speed=1.0).run(1.5)
    assert rig.core.phase is Phase.LATCHED


@pytest.mark.parametrize(
    "settings",
    [{"reaction": SLOW}, {"reaction": comply()}, {"foreign": True}, {"reaction": Reaction(fallback="path")}],
)
def test_the_same_inputs_give_the_same_run_bit_by_bit(settings):
    rig = Rig(touch(0.5, 0.7), speed=1.0, **settings).run(1.5)
    again = make_core(list(rig.skin.sensors), settings.get("reaction", Reaction()), foreign="foreign" in settings)
    outputs: list[object] = []
    for block in rig.blocks:
        again.take(Block(*block), outputs)
    assert [repr(output) for output in outputs] == [repr(output) for output in rig.outputs]
    assert any(isinstance(output, Halt | Slider | FollowerProgram) for output in outputs)
