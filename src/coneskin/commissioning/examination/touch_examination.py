"""Examination of touched frames: each says some things twice, and a right sensor does not contradict itself. Pure."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from typing import TYPE_CHECKING

from coneskin.core.finding import Finding, Verdict
from coneskin.skin.detection.frame.contact_matrix import FrameInversion
from coneskin.skin.detection.frame.reading import read
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.self_test import FrameSelfTest
from coneskin.skin.detection.untouched.currents import UntouchedCurrents

if TYPE_CHECKING:
    from coneskin.skin.sensor import Sensor
    from coneskin.skin.wire import Frame

__all__ = ["examine_touches"]

_LEAST = 20  # firm frames
_REMARKABLE = 0.25  # of the limit; a sensor whose parts are within 1 % stays below a tenth


def examine_touches(sensor: Sensor, untouched: Sequence[Frame], touched: Sequence[Frame], period: float) -> Finding:
    """Examine the frames of the guided touches.

    Args:
        sensor: as the scene describes it; its wires are in order.
        untouched: frames of the sensor at rest, by which its currents and noise are learned.
        touched: frames from the first touch to the last, those between them as well.
        period: from frame to frame [s].
    """
    item, rule = f"{sensor.name}, chi-squared", f"at most {_REMARKABLE:g} of the guard's limit"
    currents = UntouchedCurrents(sensor, DetectorSettings().current_drift)
    for frame in untouched:
        currents.feed(frame, period)
    inversion, test = FrameInversion(sensor), FrameSelfTest(sensor, currents)
    found = []
    for frame in touched:
        reading = read(sensor, frame, inversion, currents.noise)
        if reading.matrix is not None and reading.level >= sensor.thresholds.location_level:
            found.append(test.deviation(reading.matrix) ** 2)
    if len(found) < _LEAST:
        return Finding(
            item, "not tried", f"{len(found)} frames were touched firmly enough for a place", "", "press harder"
        )
    middle = statistics.median(found)
    verdict: Verdict = "ok" if middle <= _REMARKABLE else "warning" if middle <= 1.0 else "bad"
    remedy = (
        ""
        if verdict == "ok"
        else "the gains of the inputs, the shunt or the pull-downs are not what the scene says: measure pulldown_ohm, "
        "current_full_scale_ma and input_ohm of the sensor"
    )
    return Finding(
        item, verdict, f"the median of {len(found)} touched frames is {middle:.2f} of the limit", rule, remedy
    )
