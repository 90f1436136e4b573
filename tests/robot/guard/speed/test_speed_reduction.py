"""An arm that goes on slowly while it is touched."""

import pytest

from coneskin.robot.arm.models import ZERO_VELOCITY, arm_model
from coneskin.robot.driver.values import ControllerState, SetSpeedSlider, StopPath
from coneskin.robot.guard.signals.joint_current import OutsideTorque, ResistanceMonitor
from coneskin.robot.guard.speed.speed_reduction import CLEAR_TIME, SpeedReduction, _ReducedSpeedTouch
from coneskin.robot.reaction.contact_supervision import ContactApproach
from coneskin.robot.reaction.types import Reaction
from coneskin.robot.stop.limits import MonitoringLimits
from coneskin.robot.stop.stop_monitor import STANDSTILL_SAMPLES
from tests.support.guard_rig import GuardRig, touch

SLOW = 0.05  # m/s


def slowing(speed=1.0, before=1.0, fraction=0.2):
    arm = arm_model("UR5e")
    torque = OutsideTorque(arm)
    approach = ContactApproach(arm, ZERO_VELOCITY, ZERO_VELOCITY, 10.0, 5e-4)
    setting = [speed, speed], (before, min(before, fraction)), (10.2, 11.0), SLOW
    return _ReducedSpeedTouch(*setting, approach, torque, ResistanceMonitor(arm, torque, True))


def fast(one, time, speed):
    for _ in range(STANDSTILL_SAMPLES):
        one.sample(time, speed)


def test_no_trouble_where_it_becomes_slower_in_time():
    one = slowing()
    one.sample(10.1, 0.95)
    assert one.trouble(10.19, 0.2) == ""
    fast(one, 10.3, 0.89)
    assert one.trouble(10.5, 0.2) == ""


def test_trouble_where_it_becomes_faster_again():
    one = slowing()
    fast(one, 10.1, 0.3)
    fast(one, 10.4, 1.5)  # another motion: servoj does not heed the slider
    assert one.trouble(10.5, 0.2) == "the arm did not become slower"


@pytest.mark.promise("P07")
def test_trouble_where_somebody_raises_the_slider_while_it_is_touched():
    one = slowing(speed=0.2)
    one.touched(10.0, True)
    assert one.trouble(10.1, 1.0) == ""  # what is read may be older than what was set
    assert one.trouble(10.3, 0.5) == "the speed slider is at 50% again while the skin is touched"
    assert one.trouble(10.3, 0.1) == ""
    one.touched(10.4, False)
    assert one.trouble(10.4, 0.5) == ""


def test_the_slider_is_put_back_only_where_nobody_has_moved_it():
    assert slowing().puts_back(0.2)
    assert slowing().puts_back(1.0)  # what is read may be older than what was set
    assert not slowing().puts_back(0.05)
    assert not slowing().puts_back(None)


def test_trouble_at_the_budget_where_it_does_not():
    one = slowing()
    for speed in (1.0, 1.2, 1.1):  # it was still speeding up: a tenth of the top is what counts
        fast(one, 10.1, speed)
    assert one.trouble(10.199, 0.2) == ""
    fast(one, 10.2, 1.1)
    assert one.trouble(10.2, 0.2) == "the arm did not become slower"
    one.sample(10.21, 1.07)
    assert one.trouble(10.3, 0.2) == ""


def test_no_trouble_by_states_from_before_the_budget_that_a_busy_computer_reads_after_it():
    one = slowing()
    fast(one, 10.199, 1.0)
    assert one.trouble(10.9, 0.2) == ""
    one.sample(10.2, 1.0)
    assert one.trouble(10.9, 0.2) == "the arm did not become slower"


def test_a_slider_is_known_for_as_long_as_the_controller_may_be_silent():
    for silence, age in ((0.05, 0.5), (1.0, 1.0)):
        reduction = SpeedReduction(arm_model("UR5e"), used=False, silence=silence)
        reduction.feed(10.0, 0.7)
        assert reduction.known(10.0 + age) == 0.7
        assert reduction.known(10.001 + age) is None


def test_a_slow_arm_need_not_become_slower():
    one = slowing(speed=SLOW)
    assert one.trouble(10.9, 0.2) == ""


def test_a_touch_may_last_so_long_and_no_longer():
    one = slowing(speed=0.0)
    one.touched(10.0, True)
    assert one.trouble(10.99, 0.2) == ""
    assert one.trouble(11.0, 0.2) == "the touch lasts too long"
    one.touched(11.0, False)
    assert one.trouble(11.0, 0.2) == ""


def test_it_is_over_a_while_after_the_last_touch():
    one = slowing()
    for now, touched, over in (
        (10.1, True, False),
        (10.2, False, False),
        (10.2 + CLEAR_TIME - 0.01, False, False),
        (10.3 + CLEAR_TIME, True, False),  # touched again in time
        (10.4 + CLEAR_TIME, False, False),
        (10.4 + 2 * CLEAR_TIME, False, True),
    ):
        one.touched(now, touched)
        assert one.over(now) is over


def test_the_slider_is_never_raised():
    assert slowing(before=0.1).fraction == 0.1
    assert slowing().fraction == 0.2


def test_a_slider_that_a_stop_has_put_to_0_stays_there_until_the_reset():
    """The newest reading may be from before the stop: it must not look as if the slider were still where it was."""
    reduction, out = SpeedReduction(arm_model("UR5e"), used=True, silence=0.05), []
    state = ControllerState(10.0, 1.0, (0.0, -1.5, 1.5, -1.5, -1.5, 0.0), ZERO_VELOCITY, True, False, True)
    reduction.feed(10.0, 1.0)
    assert reduction.begin(10.0, state, Reaction(kind="slow", slow_to=0.2), MonitoringLimits(), [], out)
    reduction.note_stop((StopPath.SLIDER,))
    reduction.put_back(10.02, out)
    reduction.feed(10.04, 0.0)
    before, out = out, []
    reduction.release(out)
    assert [one for one in before if isinstance(one, SetSpeedSlider)] == [SetSpeedSlider(0.2)]
    assert out == [SetSpeedSlider(1.0)]


def test_a_slider_that_is_not_heard_any_more_goes_back_to_where_it_was():
    """It stayed at 20 %, and the next guard took that for the person's own."""
    reduction, out = SpeedReduction(arm_model("UR5e"), used=True, silence=0.05), []
    state = ControllerState(10.0, 1.0, (0.0, -1.5, 1.5, -1.5, -1.5, 0.0), ZERO_VELOCITY, True, False, True)
    reduction.feed(10.0, 0.9)
    assert reduction.begin(10.0, state, Reaction(kind="slow", slow_to=0.2), MonitoringLimits(), [], out)
    reduction.feed(10.02, 0.2)
    reduction.put_back(11.0, out)
    assert [one for one in out if isinstance(one, SetSpeedSlider)] == [SetSpeedSlider(0.2), SetSpeedSlider(0.9)]


@pytest.mark.long
@pytest.mark.parametrize("setting", [0.1, 0.3])
def test_a_person_who_slows_the_arm_between_two_touches_is_heard(setting):
    """0.9 before: what a slow arm had before the first touch was put back after the second."""
    rig = GuardRig(
        touch(1.0, 1.2, phi=4.71), touch(1.9, 2.2, phi=4.71), reaction=Reaction("slow"), speed=0.3, follows=True
    )
    rig.arm.slider = 0.9
    rig.run(1.8)
    rig.arm.slider, before = setting, len(rig.outputs)
    rig.run(1.1)
    set_to = [output.fraction for output in rig.outputs[before:] if isinstance(output, SetSpeedSlider)]
    assert max(set_to, default=0.0) <= setting
