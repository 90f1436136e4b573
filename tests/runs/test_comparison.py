"""Two guards' decisions are compared in millimetres and milliseconds, the arm only as long as both move it alike."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from coneskin.core.recording.defects import Defect, DefectKind
from coneskin.robot.guard.signals.journal import EventName, GuardEvent
from coneskin.runs.comparison import compare_decisions, comparison_facts, comparison_lines
from coneskin.runs.cut import CUT_TOLERANCES, cut_run
from coneskin.runs.decisions import (
    Decisions,
    _ArmCommand,
    decide_again,
    first_divergence,
    recorded_commands,
    recorded_decisions,
)
from coneskin.runs.replay.event_details import Tolerances
from coneskin.runs.replay.run import Run, read_run


def changed(decisions: Decisions, name: str, *, later: float = 0.0, **details: object) -> Decisions:
    """The decisions with one kind of event changed."""
    events = [
        GuardEvent(e.name, e.time + later, {**e.details, **details}) if e.name == name else e for e in decisions.events
    ]
    return replace(decisions, events=tuple(events), commands=None)


def test_a_replay_is_the_same_as_the_recording_commands_included(collision: Run, again: Decisions) -> None:
    recorded = recorded_decisions(collision)
    assert recorded.commands is not None
    assert again.commands is not None
    assert len(recorded.commands) == 148
    assert first_divergence(recorded.commands, again.commands) == float("inf")
    comparison = compare_decisions(recorded, again)
    assert comparison.same
    assert (comparison.paired, comparison.differences, comparison.diverged) == (14, (), None)


def test_a_failure_reads_in_millimetres_and_milliseconds(again: Decisions) -> None:
    contact = next(e for e in again.events if e.name == EventName.CONTACT)
    moved = changed(again, "contact", u=contact.details["u"] + 0.0012)
    moved = changed(moved, "stopping", later=0.0022)
    (difference,) = compare_decisions(again, moved).differences
    assert str(difference) == "contact 1: u 129.8 -> 131.0 mm; stop 2.2 ms later"
    (difference,) = compare_decisions(moved, again).differences
    assert str(difference) == "contact 1: u 131.0 -> 129.8 mm; stop 2.2 ms earlier"


def test_a_difference_shows_as_many_digits_as_it_takes(again: Decisions) -> None:
    contact = next(e for e in again.events if e.name == EventName.CONTACT)
    (difference,) = compare_decisions(again, changed(again, "contact", u=contact.details["u"] + 3e-8)).differences
    assert re.fullmatch(r"contact 1: u 129\.\d{4,6} -> 129\.\d{4,6} mm", str(difference))
    assert "0x" not in str(difference)


@pytest.mark.parametrize(
    ("name", "detail", "step", "tolerance"),
    [
        ("contact", "u", 1e-3, "place_mm=1.01"),
        ("contact", "phi", 0.01, "angle_deg=0.6"),
        ("contact", "level", 0.02, "level=0.021"),
        ("decelerating", "speed", 0.02, "speed_rad_s=0.021"),
    ],
)
def test_each_quantity_has_its_tolerance(again: Decisions, name: str, detail: str, step: float, tolerance: str) -> None:
    value = next(e for e in again.events if e.name == name).details[detail]
    moved = changed(again, name, **{detail: value + step})
    first = (again, replace(again, commands=None))[1]
    moved = replace(moved, events=moved.events)
    one = replace(first, events=tuple(e for e in first.events if e.name == name)[:1])
    other = replace(moved, events=tuple(e for e in moved.events if e.name == name)[:1])
    assert compare_decisions(one, other).differences
    assert not compare_decisions(one, other, Tolerances.from_words([tolerance])).differences
    unit, _, limit = tolerance.partition("=")
    assert compare_decisions(one, other, Tolerances.from_words([f"{unit}={0.4 * float(limit)}"])).differences


def test_what_is_missing_and_what_is_new_is_named_with_its_place(again: Decisions) -> None:
    silent = replace(again, events=tuple(e for e in again.events if e.details.get("sensor") is None), commands=None)
    lost = compare_decisions(again, silent)
    assert str(lost.differences[0]) == "contact 1: touch is missing on forearm skin, u 129.8 mm, phi 89.2 deg"
    assert (lost.new, lost.missing) == (0, 3)
    found = compare_decisions(silent, again)
    assert str(found.differences[-1]) == "new contact 1: touch is new on forearm skin, u 129.8 mm, phi 89.2 deg"
    assert (found.new, found.missing) == (3, 0)


def test_after_a_divergence_the_arm_is_not_compared_and_nothing_is_invented(collision: Run, again: Decisions) -> None:
    """The recorded arm retreats; a guard that only stops would have seen it "not standing"."""
    stops = decide_again(collision, {"reaction.kind": "stop"})
    invented = {event.name for event in stops.events} - {event.name for event in again.events}
    assert EventName.STOP_FAILED in invented
    comparison = compare_decisions(again, stops)
    assert [str(d) for d in comparison.differences] == ["retreat: missing"]
    retreating = next(e for e in again.events if e.name == EventName.RETREATING)
    assert comparison.diverged == pytest.approx(retreating.time - again.start)
    assert comparison.not_compared > 5
    assert not comparison.same
    text = "\n".join(comparison_lines(comparison))
    assert "from 3.0558 s on the arm is commanded otherwise" in text
    assert "NOT confirmed" not in text
    assert "stop_failed" not in text


def test_the_contacts_are_compared_beyond_a_divergence(collision: Run, again: Decisions) -> None:
    firm = decide_again(collision, {"detection.touch_level": 0.4, "detection.location_level": 0.4})
    comparison = compare_decisions(again, firm)
    (difference,) = comparison.differences
    assert difference.subject == "contact 1"
    assert "stop 0.7 ms later" in difference.words
    assert difference.delay == pytest.approx(0.7e-3, abs=0.05e-3)
    assert difference.moved == pytest.approx(0.19e-3, abs=0.05e-3)
    assert comparison.paired == 5  # activated, stop, contact, located, end


@pytest.mark.parametrize("place", [0, 1, 70, 147])
def test_one_command_more_or_otherwise_is_a_divergence(collision: Run, place: int) -> None:
    commands = list(recorded_commands(collision.blocks))
    without = commands[:place] + commands[place + 1 :]
    assert first_divergence(commands, without) == commands[place].time
    numbers = tuple(1.001 * n for n in commands[place].numbers)
    other = [*commands[:place], commands[place]._replace(numbers=numbers), *commands[place + 1 :]]
    assert first_divergence(commands, other) == commands[place].time
    last_bits = [c._replace(numbers=tuple(n * (1 + 1e-15) for n in c.numbers)) for c in commands]
    assert first_divergence(commands, last_bits) == float("inf")
    assert not _ArmCommand(1.0, "a", ()).equals(_ArmCommand(1.001, "a", ()), Tolerances())


@pytest.mark.parametrize(
    ("what", "tolerances"),
    [
        ("SetJointVelocity", Tolerances(speed=0.01)),
        ("setpoint", Tolerances(speed=0.01)),
        ("slider", Tolerances(level=0.01)),
        ("StopProgram", Tolerances(relative=0.02)),
    ],
)
def test_a_command_has_the_tolerance_of_its_quantity(what: str, tolerances: Tolerances) -> None:
    one, near, far = (_ArmCommand(1.0, what, (0.5 + step,)) for step in (0.0, 0.009, 0.011))
    assert one.equals(near, tolerances)
    assert not one.equals(near, Tolerances())
    assert not one.equals(far, tolerances)
    assert one.equals(one._replace(time=1.004), Tolerances(time=0.005))
    assert not one.equals(one._replace(time=1.006), Tolerances(time=0.005))


@pytest.mark.long
def test_a_cut_is_the_same_as_its_run_within_the_tolerances_of_a_cut(collision: Run, tmp_path: Path) -> None:
    cut = read_run(cut_run(collision, tmp_path / "cut.rec", around=2.95).path)
    sides = recorded_decisions(collision), recorded_decisions(cut)
    for one, other in (sides, sides[::-1]):
        comparison = compare_decisions(one, other, CUT_TOLERANCES)
        assert comparison.same, comparison_lines(comparison)
        assert comparison.paired == 8  # what became of the touch; how the cut began is not compared


def test_what_both_say_once_of_the_arm_is_one_thing_at_any_time_and_what_comes_twice_has_a_number() -> None:
    def told(*events: tuple[EventName, float]) -> Decisions:
        return Decisions("", tuple(GuardEvent(name, time, {}) for name, time in events), None, start=0.0)

    stands, latched = EventName.STANDSTILL, EventName.LATCHED
    one, other = told((stands, 1.0), (stands, 2.0), (latched, 3.0)), told((stands, 1.1), (latched, 5.0))
    found = [str(difference) for difference in compare_decisions(one, other).differences]
    assert found == ["standstill 1: 100.0 ms later", "standstill 2: missing", "latched: 2000.0 ms later"]
    one, other = told((stands, 1.0)), told((stands, 0.9), (stands, 1.02), (stands, 3.0))
    found = [str(difference) for difference in compare_decisions(one, other).differences]
    assert found == ["standstill 1: new", "standstill 2: 20.0 ms later", "standstill 3: new"], "the nearest pair"


def test_a_run_that_has_lost_something_is_compared_up_to_there_and_is_not_the_same(again: Decisions) -> None:
    contact = next(e for e in again.events if e.name == EventName.CONTACT)
    torn = replace(again, until=contact.time + 0.01, missing="12 bytes")
    comparison = compare_decisions(torn, again)
    assert comparison.differences == ()
    assert not comparison.same
    assert comparison.until == pytest.approx(contact.time + 0.01 - again.start)
    assert comparison.paired == 4
    assert "12 bytes" in "\n".join(comparison_lines(comparison))


def test_a_guard_is_not_given_what_follows_a_gap(collision: Run, again: Decisions) -> None:
    contact = next(e for e in again.events if e.name == EventName.CONTACT)
    lost = Defect(DefectKind.LOST, since=contact.time - 0.02, until=contact.time - 0.01, blocks=9)
    torn = decide_again(replace(collision, defects=(lost,)))
    assert [event.name for event in torn.events] == ["activated"]
    assert torn.until == contact.time - 0.02


def test_what_only_follows_from_another_difference_is_not_told(again: Decisions) -> None:
    details = next(e for e in again.events if e.name == EventName.CONTACT).details
    point = [details["point"][0] + 0.002, *details["point"][1:]]
    (both,) = compare_decisions(again, changed(again, "contact", u=details["u"] + 0.002, point=point)).differences
    assert both.words == ("u 129.8 -> 131.8 mm",)
    assert both.moved == pytest.approx(0.002)
    (alone,) = compare_decisions(again, changed(again, "contact", point=point)).differences
    assert alone.words == ("point moved by 2.0 mm",)


def test_two_runs_of_which_nothing_is_known_are_not_the_same(again: Decisions) -> None:
    nothing = replace(again, events=(), commands=())
    comparison = compare_decisions(nothing, nothing)
    assert not comparison.same
    assert "nothing to compare" in comparison_lines(comparison)[-1]


def test_another_run_is_shifted_so_that_the_first_contacts_coincide(again: Decisions) -> None:
    later = tuple(event._replace(time=event.time + 1234.5) for event in again.events)
    other = replace(again, events=later, start=again.start + 1000.0)
    comparison = compare_decisions(again, other, Tolerances(time=1e-6))
    assert comparison.differences == ()
    assert comparison.paired == 14


def test_the_facts_for_a_program_have_units(again: Decisions) -> None:
    contact = next(e for e in again.events if e.name == EventName.CONTACT)
    point = [contact.details["point"][0] + 0.002, *contact.details["point"][1:]]
    moved = changed(again, "contact", later=0.001, u=contact.details["u"] + 0.002, point=point)
    facts = comparison_facts(compare_decisions(again, moved))
    assert facts["moved_mm"] == pytest.approx(2.0)
    assert facts["differences"][0]["delay_ms"] == pytest.approx(1.0)
    assert (facts["same"], facts["new"], facts["missing"]) == (False, 0, 0)


def test_what_a_guard_learns_of_the_noise_is_no_difference_of_a_cut(again: Decisions) -> None:
    known = changed(again, "contact_located", covariance=[1e-9, 0.0, 1e-9], ellipse=[[1e-5, 0.0], [0.0, 1e-5]])
    unknown = changed(again, "contact_located", covariance=None, ellipse=None)
    assert not compare_decisions(known, unknown).same
    contact = next(e for e in again.events if e.name == EventName.CONTACT)
    cut = replace(unknown, window=(contact.time - 1.0, contact.time + 1.0))
    assert compare_decisions(known, cut, CUT_TOLERANCES).same
