"""The guard's core, explored to the end of its states, and what the explorer finds in a guard that is broken."""

import math
import random
from pathlib import Path

import pytest

from coneskin.runs.replay.run import read_run
from tests.support.exploration.breaks import BREAKS, broken, find
from tests.support.exploration.explorer import explore, follow, wander
from tests.support.exploration.guard_world import INVARIANTS, PROGRESS, REACTIONS, GuardWorld, Settings
from tests.support.exploration.process_world import HEEDLESS_PROGRAM, PATIENT_CONTROLLER, Parts, ProcessWorld

pytestmark = pytest.mark.long

#: CI's share; `python -m bench exploration` explores every reaction with each control
_EXPLORED = [("stop", "internal")]


@pytest.mark.long
@pytest.mark.parametrize(("reaction", "control"), _EXPLORED)
def test_no_invariant_breaks_in_any_state(reaction: str, control: str) -> None:
    found = explore(GuardWorld(Settings(reaction, control)), PROGRESS)
    assert found.broken == {}
    assert found.closed


@pytest.mark.long
@pytest.mark.parametrize(("reaction", "control"), [("stop", "internal"), ("retreat", "external")])
def test_no_invariant_breaks_by_chance_where_no_state_stands_for_others(reaction: str, control: str) -> None:
    for seed in range(8):
        draw = random.Random(seed)
        way, _, wrong = wander(GuardWorld(Settings(reaction, control), draw=draw), draw, 30, PROGRESS)
        assert not wrong, (seed, way)


@pytest.mark.long
@pytest.mark.parametrize(("reaction", "control"), [*((kind, "internal") for kind in REACTIONS), ("stop", "external")])
def test_a_touch_of_either_sensor_is_answered_and_latched_and_forgiven(reaction: str, control: str) -> None:
    touches = frozenset({"wait", "wait for a change", "a program moves", "unlock", "reset"})
    found = explore(
        GuardWorld(
            Settings(reaction, control, sensors=2), only=touches | {"touch one", "mend one", "touch two", "mend two"}
        ),
        PROGRESS,
    )
    assert found.broken == {}
    assert found.closed


@pytest.mark.long
def test_from_a_slider_that_a_stop_has_put_to_0_a_person_gets_back_to_active() -> None:
    blind = {"states mute", "mend the states", "touch one", "mend one", "the program ends"}
    only = frozenset({"wait", "wait for a change", "a program moves", "unlock", "reset"} | blind)
    found = explore(GuardWorld(Settings("slow", "external"), only=only), PROGRESS)
    assert found.broken == {}
    assert found.closed


@pytest.mark.long
@pytest.mark.parametrize(
    ("control", "parts", "most_wrong"),
    [("internal", {}, 2), ("external", HEEDLESS_PROGRAM, 1), ("external", {}, 1)],
)
def test_no_silence_of_a_process_is_left_alone(control: str, parts: dict[str, float], most_wrong: int) -> None:
    found = explore(ProcessWorld(control, Parts(**parts), most_wrong), PROGRESS)
    assert found.broken == {}
    assert found.closed


@pytest.mark.long
def test_of_two_processes_that_fall_silent_at_once_neither_is_left_alone() -> None:
    found = explore(ProcessWorld("external", Parts(**HEEDLESS_PROGRAM), without=("lose", "touch", "thaw")))
    assert found.broken == {}
    assert found.closed


@pytest.mark.parametrize(
    ("control", "base", "part", "becomes", "breaks"),
    [
        ("internal", {}, "program_silence", math.inf, "frozen"),
        ("internal", {}, "guard_silence", math.inf, "unguarded"),
        ("internal", {}, "watchdog", math.inf, "cut"),
        ("internal", PATIENT_CONTROLLER, "process_silence", math.inf, "frozen"),
        ("internal", PATIENT_CONTROLLER, "hold_up", math.inf, "frozen"),
        ("internal", PATIENT_CONTROLLER, "hold_up", 0.0, "held up"),
        ("external", HEEDLESS_PROGRAM, "program_silence", math.inf, "frozen"),
        ("external", HEEDLESS_PROGRAM, "process_silence", math.inf, "frozen"),
        ("external", HEEDLESS_PROGRAM, "hold_up", math.inf, "frozen"),
        ("external", HEEDLESS_PROGRAM, "hold_up", 0.0, "held up"),
        ("external", HEEDLESS_PROGRAM, "guard_silence", math.inf, "unguarded"),
        ("external", HEEDLESS_PROGRAM, "second_silence", math.inf, "unguarded"),
    ],
)
def test_without_one_who_listens_the_arm_moves_on(
    control: str, base: dict[str, float], part: str, becomes: float, breaks: str
) -> None:
    without = ("lose", "touch", "reset", "thaw", "restart", "kill")
    world = ProcessWorld(control, Parts(**{**base, part: becomes}), without=without)
    assert breaks in explore(world, stop_at_first=True).broken


@pytest.mark.parametrize(
    ("parts", "most_wrong"), [({"forbids": False, "setpoint": math.inf}, 1), ({"forbids": False}, 2)]
)
def test_a_setpoint_that_outlives_the_silence_of_its_guard_moves_a_latched_arm(
    parts: dict[str, float], most_wrong: int
) -> None:
    world = ProcessWorld("internal", Parts(**parts), most_wrong)  # type: ignore[arg-type]
    assert "released" in explore(world, stop_at_first=True).broken


@pytest.mark.pure
@pytest.mark.parametrize("name", INVARIANTS)
def test_each_invariant_that_is_broken_on_purpose_is_found(name: str) -> None:
    assert name in BREAKS
    assert name in find(name).broken


@pytest.mark.pure
def test_a_way_to_a_broken_invariant_is_a_recording_that_replays(tmp_path: Path) -> None:
    way, said = find("still").broken["still"]
    with broken("still"):
        world = GuardWorld(Settings(), recorded=True)
        assert said in follow(world, way)
        world.write(tmp_path / "way.rec")
        again = read_run(tmp_path / "way.rec").replay()
    assert again.same
    assert "latched" in [event.name for event in again.events]
