"""The table of transitions: what must hold of it whatever is fed."""

import pytest

from coneskin.robot.guard.phase import TRANSITIONS, Act, Cue, Phase, Supervision, transition


def reached(*start: Phase, without: frozenset[Cue] = frozenset()) -> set[Phase]:
    """Phases to which cues lead from some."""
    found = set(start)
    while more := {to for (at, cue), (to, _) in TRANSITIONS.items() if at in found and cue not in without} - found:
        found |= more
    return found


def test_every_phase_is_reached_and_every_one_but_the_first_leads_to_latched() -> None:
    assert reached(Phase.STARTING) == set(Phase)
    assert all(Phase.LATCHED in reached(phase) for phase in Phase)


def test_only_a_release_makes_it_active_or_lets_a_latched_arm_go() -> None:
    no_release = frozenset({Cue.ACTIVATED})
    assert not reached(Phase.LATCHED, without=no_release) & {Phase.STARTING, Phase.ACTIVE, Phase.SLOWED}
    assert not reached(Phase.STARTING, without=no_release) - {Phase.STARTING}


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase.watched])
@pytest.mark.parametrize("cue", [Cue.FAULTED, Cue.TOUCHED])
def test_a_fault_and_a_touch_stop_whatever_moves(phase: Phase, cue: Cue) -> None:
    then, act = transition(Supervision(phase, barred="x"), cue, "why")
    assert then.phase.brakes
    assert act in (Act.STOP, Act.HALT)


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase.stands])
def test_an_arm_that_moves_although_it_has_to_stand_is_stopped_and_does_not_move_away(phase: Phase) -> None:
    then, act = transition(Supervision(phase, 3, "touch", may_move=True), Cue.MOVED, "something moved the arm")
    assert (then.phase, then.stop, then.may_move, act) == (Phase.STOPPING, 4, False, Act.STOP)
    assert then.why == "touch; then something moved the arm"


def test_after_a_fault_nothing_of_ours_moves_the_arm_until_the_next_stop() -> None:
    for phase in Phase:
        if phase is not Phase.STARTING and phase is not Phase.LATCHED:
            assert not transition(Supervision(phase, may_move=True), Cue.FAULTED, "why")[0].may_move


def test_a_motion_away_begins_only_from_a_standstill_after_a_stop() -> None:
    begins = {at for (at, _), (to, _) in TRANSITIONS.items() if to is Phase.RETREATING}
    assert begins == {Phase.STOPPING, Phase.PLACING}


def test_a_cue_without_a_row_changes_nothing() -> None:
    state = Supervision(Phase.LATCHED, 2, "touch")
    assert transition(state, Cue.FAULTED, "later") == (state, Act.NONE)
    assert transition(state, Cue.TOUCHED) == (state, Act.NONE)
