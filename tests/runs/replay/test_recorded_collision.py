"""A collision that ``coneskin demo`` recorded once is a regression test ever since."""

import pytest

from coneskin.runs.replay.run import read_run
from tests.support.paths import COLLISION

RUN = COLLISION


@pytest.fixture(scope="module")
def result():
    return read_run(RUN).replay()


def test_the_same_happens_again(result):
    """Names and times exactly; numbers to 1e-9, because another machine's sin and cos may differ in the last bit."""
    assert [(e.name, e.time) for e in result.events] == [(e.name, e.time) for e in result.recorded]
    for again, then in zip(result.events, result.recorded, strict=True):
        assert again.details.keys() == then.details.keys()
        for key, value in then.details.items():
            assert same(again.details[key], value), key


def same(got: object, value: object) -> bool:
    if isinstance(value, list | tuple):
        return len(got) == len(value) and all(same(*pair) for pair in zip(got, value, strict=True))  # type: ignore[arg-type]
    return got == (pytest.approx(value, rel=1e-9, abs=1e-12) if isinstance(value, float) else value)


def test_what_happened_is_what_the_demo_did(result):
    """Checked by hand when it was recorded: the demo touches at u = 130 mm, phi = 89 deg, and retreats 20 mm."""
    assert [event.name for event in result.events] == [
        "activated", "stopping", "contact", "decelerating", "contact_located", "standstill", "retreating",
        "motion_limited", "touch_ended", "retreated", "decelerating", "standstill", "latched", "ending",
    ]  # fmt: skip
    placed = next(event for event in result.events if event.name == "contact_located")
    assert placed.details["u"] == pytest.approx(0.130, abs=0.0005)
    assert placed.details["phi"] == pytest.approx(1.5533, abs=0.005)
    retreated = next(event for event in result.events if event.name == "retreated")
    assert retreated.details["progress"] == pytest.approx(0.0196, abs=0.0003)
    assert result.missing == ""


def test_another_reaction_would_have_stood_still():
    from coneskin.scene.reader import parse_scene

    run = read_run(RUN)
    only_stop = parse_scene(run.header["scene"].replace('kind = "retreat"', 'kind = "stop"'))
    names = [event.name for event in run.replay(only_stop).events]
    assert "retreating" not in names
    assert "latched" in names
