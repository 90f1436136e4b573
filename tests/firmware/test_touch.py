"""A touch on the emulated board: its frames, and what the skin reads from them."""

import pytest

from coneskin.skin.detection.events import SkinFault, TouchBegan, TouchEnded, TouchMoved
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.wire import FrameDecoder, Status
from tests.support.firmware.emulated_board import run_board

pytestmark = pytest.mark.long
RADIUS = 0.0375  # m
TOUCH = ScriptedTouch(1.0, 1.6, 0.1, 2.0, 10.0)


def test_a_touch_is_read_where_it_is(programs, sensor):
    run = run_board(programs, sensor, 2.0, [TOUCH])
    frames = FrameDecoder().feed(run.data)
    assert len(frames) == pytest.approx(2.0 * 200, abs=3)
    assert [frame.sequence for frame in frames] == list(range(len(frames)))
    assert frames[0].status == Status.RESTARTED
    assert {frame.status for frame in frames[1:]} == {0, Status.TOUCH}
    stream = TouchStream([sensor])
    events = []
    for number, at in enumerate(range(0, len(run.data), 52)):
        events += stream.feed(run.data[at : at + 52], 0.005 * number)
    assert [event for event in events if isinstance(event, SkinFault)] == []
    (began,) = [event for event in events if isinstance(event, TouchBegan)]
    assert len([event for event in events if isinstance(event, TouchEnded)]) == 1
    certain = [event for event in events if isinstance(event, TouchMoved) and event.location_valid]
    assert certain, "the place of the touch never became certain"
    for touch in [began, *certain]:  # 11 bits and 1.5 mV of noise: 0.1 mm; the pins' resistance is known to a tenth
        assert touch.u == pytest.approx(TOUCH.u, abs=0.5e-3)
        assert RADIUS * touch.phi == pytest.approx(RADIUS * TOUCH.phi, abs=0.5e-3)
