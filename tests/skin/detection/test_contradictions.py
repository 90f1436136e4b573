"""Frames that contradict themselves: a contact that changes, or a fault."""

import pytest

from coneskin.skin.detection.contradictions import Contradictions
from coneskin.skin.detection.frame.faults import Fault


def test_three_in_a_row_may_be_a_contact_and_each_one_more_is_a_fault() -> None:
    frames = Contradictions()
    assert [frames.is_change(Fault.LEAK) for _ in range(5)] == [True, True, True, False, False]


def test_ten_good_frames_make_up_for_one() -> None:
    frames = Contradictions()
    while frames.is_change(Fault.OUT_OF_RANGE):
        pass
    for _ in range(10):
        frames.forget()
    assert frames.count == pytest.approx(2.0)
    assert frames.is_change(Fault.OUT_OF_RANGE)
    assert not frames.is_change(Fault.OUT_OF_RANGE)


def test_good_frames_alone_are_no_credit() -> None:
    frames = Contradictions()
    for _ in range(100):
        frames.forget()
    assert frames.count == 0.0


@pytest.mark.parametrize("fault", [Fault.STUCK, Fault.RESTARTED, Fault.SILENT])
def test_no_contact_looks_like_another_fault(fault: Fault) -> None:
    frames = Contradictions()
    assert not frames.is_change(fault)
    assert frames.count == 0.0
