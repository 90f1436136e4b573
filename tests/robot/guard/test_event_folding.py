"""Events that repeat themselves: counted, never lost, and few."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from coneskin.robot.guard.phase import Phase
from coneskin.robot.guard.signals.journal import BlockKind, EventFolding, EventName
from coneskin.robot.reaction.types import Reaction
from tests.support.guard_rig import GuardRig, touch


@pytest.mark.promise("P57")
@given(st.lists(st.tuples(st.floats(0.0, 30.0), st.sampled_from("ab")), max_size=60))
def test_every_event_is_put_out_or_counted(gaps):
    folding, out, now = EventFolding(), [], 0.0
    for gap, about in gaps:
        now += gap
        folding.poll(now, out)
        folding.emit(out, EventName.FAULT, about, now, what=about)
    folding.flush(now, out)
    for about in "ab":
        came = sum(a == about for _, a in gaps)
        assert sum(e.details.get("count", 1) for e in out if e.details["what"] == about) == came


@pytest.mark.promise("P57")
def test_a_loose_plug_of_a_night_is_a_hundred_lines():
    folding, out = EventFolding(), []
    for n in range(14 * 3600):  # an hour
        folding.poll(n / 14.0, out)
        folding.emit(out, EventName.FAULT, "open", n / 14.0, what="open")
    assert len(out) < 30
    assert out[:10] == [e for e in out if "count" not in e.details]


@pytest.mark.long
def test_states_that_are_no_numbers_are_one_fault_and_counts():
    """500 events a second before, and a list of faults that grew with each."""
    rig = GuardRig(touch(0.5, 0.7), reaction=Reaction("stop"), speed=1.0).run(1.0)
    assert rig.core.phase is Phase.LATCHED
    step = rig.arm.poll

    def nonsense():
        payload = bytearray(step())
        payload[9:17] = struct.pack(">d", math.nan)  # the first joint's position
        payload[17:25] = struct.pack(">d", rig.now)  # another text each time
        return bytes(payload)

    rig.arm.poll = nonsense
    before = len(rig.events)
    rig.run(3.2)
    faults = [e for e in rig.events[before:] if e.name == "fault" and "cannot be read" in e.details["what"]]
    assert len(faults) < 20
    assert sum(e.details.get("count", 1) for e in faults) > 500
    assert len(rig.core._faults) < 5


@pytest.mark.long
def test_touches_of_a_latched_arm_are_counted_and_those_of_an_active_one_are_not():
    many = [touch(1.1 + 0.04 * n, 1.12 + 0.04 * n) for n in range(24)]
    rig = GuardRig(touch(0.5, 0.7), *many, reaction=Reaction("stop"), speed=1.0).run(2.7)
    later = [e for e in rig.events if e.name == "contact" and e.time > 101.0]
    assert len(later) < 20
    assert sum(e.details.get("count", 1) for e in later) == 24
    rig.feed(BlockKind.TICK)
