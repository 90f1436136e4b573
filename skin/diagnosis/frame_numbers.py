"""Numbers of the frames of one sensor: sequence and clock, against the host's clock, and how regularly they come."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import linear_regression, median_high

from coneskin.core.finding import Finding
from coneskin.skin.wire import Frame

from .cause import Cause

_MIN_FRAMES = 8
_STEADY_SHARE = 0.9  # of the steps that must be of one kind
_MIN_RATE = 100.0  # Hz
_CLOCK_TOLERANCE = 0.015  # of its speed; a ceramic resonator is off by 0.005
_UNEVEN = 0.005  # of it, between two parts of the time
_HELD_BACK = 0.012  # s from one group of frames to the next, where the frames themselves are closer
_HELD_UP = 0.03  # s of frames that are read at once: no adapter's latency timer is as long
_LOST_SHARE = 0.02  # share of frames
_REPEATED_SHARE, _UNCOUNTED_SHARE = 0.01, 0.01  # a guard stops at each
_CHANCE_FRAMES = 3  # frames that may be chance
_LINE_TURNS = 3
_TIME_PARTS = 6  # of the time, in each of which some frame is quick
_MIN_TIME = 0.25  # s over which the clocks can be compared


@dataclass(frozen=True, slots=True)
class FrameNumbers:
    """How the frames of one sensor follow each other."""

    rate: float  #: frames a second, by the host's clock; nan where that is not known
    clock_ratio: float  #: speed of the device's clock over that of the host; nan where it is not known
    missing: float  #: share of the sequence numbers that never came
    period: float  #: device time from frame to frame, the middle one [s]
    held_up: float  #: for how long this computer has left frames unread, by those that it then read at once [s]
    hidden: bool  #: it was held up for so long, or so often, that the ratio of the clocks may be 1


def measure_numbers(frames: Sequence[Frame], times: Sequence[float]) -> FrameNumbers:
    """Measure how frames of one sensor, in their order, follow each other; each came at a time of the host [s]."""
    steps, ticks = _sequence_steps(frames), _clock_steps(frames)
    seconds = times[-1] - times[0] if times else 0.0
    rate = (len(frames) - 1) / seconds if seconds > 0.0 else math.nan
    forward = [step for step in steps if 0 < step < 0x8000]
    missing = sum(step - 1 for step in forward) / max(1, sum(forward))
    middle = median_high(ticks) * 1e-6 if ticks else 0.0
    ratio, uneven = _slope(ticks, times) if seconds >= _MIN_TIME else (math.nan, False)
    held = _held_up(ticks, times)
    hidden = uneven or held > 0.5 * seconds or abs(ratio - 1.0) * (seconds - held) <= held
    return FrameNumbers(rate, ratio, missing, middle, held, hidden)


def _held_up(ticks: Sequence[int], times: Sequence[float]) -> float:
    total = span = gap = 0.0
    for tick, (before, now) in zip([*ticks, 0], itertools.pairwise([*times, math.inf]), strict=True):
        if now == before:
            span += 1e-6 * tick
            continue
        total += max(span, gap) if span > _HELD_UP else 0.0
        span, gap = 0.0, now - before
    return total


def _sequence_steps(frames: Sequence[Frame]) -> list[int]:
    """Return the steps of the sequence, modulo 65536."""
    return [(b.sequence - a.sequence) & 0xFFFF for a, b in itertools.pairwise(frames)]


def _clock_steps(frames: Sequence[Frame]) -> list[int]:
    """Return the steps of the device's clock [us], signed."""
    return [((b.clock_us - a.clock_us + 0x80000000) & 0xFFFFFFFF) - 0x80000000 for a, b in itertools.pairwise(frames)]


def _slope(ticks: Sequence[int], times: Sequence[float]) -> tuple[float, bool]:
    """Return the speed of the device's clock over that of the host, and whether parts of the time contradict it.

    A frame comes late, never early, and a computer that is held up reads frames late for a while: they fall behind at
    once, and stay or come back. Clocks of two speeds move apart all the time. So a first line by least squares is
    turned to the middle one of the steps between the quickest frames of each part of the time; where two of them show
    no such speed, it is the frames of these parts that are late.
    """
    clocks = list(itertools.accumulate(ticks, initial=0))
    count, slope = len(times), linear_regression(times, clocks).slope
    steps: list[float] = []
    edges = [count * part // _TIME_PARTS for part in range(_TIME_PARTS + 1)]
    for _ in range(_LINE_TURNS if count >= _TIME_PARTS * _MIN_FRAMES else 0):
        if not slope > 0.0:
            break
        lag = [time - clock / slope for time, clock in zip(times, clocks, strict=True)]
        quickest = itertools.pairwise(min(range(a, b), key=lag.__getitem__) for a, b in itertools.pairwise(edges))
        steps = sorted((clocks[b] - clocks[a]) / max(times[b] - times[a], 1e-6) for a, b in quickest)
        slope = median_high(steps)
    second = steps[1 if slope > 1e6 else -2] if steps else slope
    apart, off = 1e-6 * abs(slope - second), math.copysign(1e-6, slope - 1e6) * (second - 1e6)
    return 1e-6 * slope, apart > _UNEVEN and off < _CLOCK_TOLERANCE


def find_wrong_numbers(frames: Sequence[Frame], times: Sequence[float], sensors: int) -> Finding | None:
    """Say what is wrong with sequence and clock of the frames of one sensor, of so many that send on this line."""
    if len(frames) < _MIN_FRAMES:
        return None
    numbers = measure_numbers(frames, times)
    return (
        _find_repeats(frames)
        or _find_sequence(frames, sensors)
        or _find_clock(frames, numbers)
        or _find_rate(frames, times, numbers)
    )


def _find_repeats(frames: Sequence[Frame]) -> Finding | None:
    pairs = len(frames) - 1
    same = sum(a[4:6] == b[4:6] for a, b in itertools.pairwise(frames))
    if len({frame[4:6] for frame in frames}) == 1 and len(set(frames)) > 1:
        return None  # neither sequence nor clock is ever written
    if same >= max(_CHANCE_FRAMES, _REPEATED_SHARE * pairs):
        return Cause.REPEATED.found(f"{same} of {pairs} frames are the one before once more")
    return None


def _find_sequence(frames: Sequence[Frame], sensors: int) -> Finding | None:
    steps = _sequence_steps(frames)
    (step, count), *_ = Counter(steps).most_common(1)
    share = count / len(steps)
    if step == 0 and share >= _STEADY_SHARE:
        return Cause.SEQUENCE_STANDS.found(f"the sequence stands at {frames[-1].sequence}")
    if step == 1 and share >= 0.5:
        if max(frame.sequence for frame in frames) == 0xFF and 0xFF01 in steps:
            return Cause.SEQUENCE_8_BIT.found("the sequence goes from 255 back to 0")
        return None
    forward = [step for step in steps if 0 < step < 0x8000]
    if len(forward) < 0.7 * len(steps) or max(forward) > 4096:
        return Cause.SEQUENCE_RANDOM.found(f"the sequence does not count: {[frame.sequence for frame in frames[-4:]]}")
    if share >= _STEADY_SHARE and step == sensors:
        return Cause.SEQUENCE_SHARED.found(f"the {sensors} sensors share one sequence, which goes up by {step}")
    if share >= _STEADY_SHARE:
        return Cause.SEQUENCE_STEPS.found(f"the sequence goes up by {step} from frame to frame")
    return None


def _find_clock(frames: Sequence[Frame], numbers: FrameNumbers) -> Finding | None:
    ticks = _clock_steps(frames)
    if not any(ticks):
        return Cause.CLOCK_STANDS.found(f"the device's clock stands at {frames[-1].clock_us}")
    if max(frame.clock_us for frame in frames) <= 0xFFFF and any(-0x10000 <= tick < -0x4000 for tick in ticks):
        return Cause.CLOCK_16_BIT.found("the device's clock goes from 65535 back to 0")
    if sum(tick < 0 for tick in ticks) > 0.05 * len(ticks):
        return Cause.CLOCK_JUMPS.found(f"the device's clock goes back: {[frame.clock_us for frame in frames[-4:]]} us")
    ratio = numbers.clock_ratio
    if math.isnan(ratio):
        return None
    for factor, cause, unit in (
        (1e-3, Cause.CLOCK_MILLISECONDS, "milliseconds"),
        (1e-6, Cause.CLOCK_SECONDS, "seconds"),
        (1e3, Cause.CLOCK_NANOSECONDS, "nanoseconds"),
    ):
        if 0.9 * factor < ratio < 1.1 * factor:
            return cause.found(f"the device's clock counts {unit}")
    if abs(ratio - 1.0) > _CLOCK_TOLERANCE:
        if numbers.hidden:
            held = f"{1e3 * numbers.held_up:.0f} ms of them at once"
            return Cause.HELD_UP.found(f"this computer held frames up, {held}, which hides the clock")
        return Cause.CLOCK_RATIO.found(f"the device's clock runs {ratio:.3f} times as fast as the computer's")
    period = 1e6 * numbers.period
    steps = zip(_sequence_steps(frames), ticks, strict=True)
    left_out = [tick / period for step, tick in steps if step == 1 and tick > 1.5 * period]
    even = sum(abs(count - round(count)) < 0.2 for count in left_out)
    if even >= max(_CHANCE_FRAMES, _UNCOUNTED_SHARE * len(ticks), 0.8 * len(left_out)):
        return Cause.UNCOUNTED.found(f"before {even} of {len(ticks)} frames there is time for others, and no number")
    uneven = sum(abs(tick - period) > 0.5 * period + 2e3 for tick in ticks)
    if uneven > 0.1 * len(ticks):
        return Cause.CLOCK_JUMPS.found(f"the device's clock jumps in {uneven} of {len(ticks)} frames")
    return None


def _find_rate(frames: Sequence[Frame], times: Sequence[float], numbers: FrameNumbers) -> Finding | None:
    if numbers.missing > _LOST_SHARE:
        lost, held = f"{100.0 * numbers.missing:.1f} % of the frames never come", numbers.held_up
        if held >= numbers.missing * (times[-1] - times[0]):  # no more can be lost in that time
            return Cause.HELD_UP.found(f"{lost}, and this computer held others up for {1e3 * held:.0f} ms")
        return Cause.FRAMES_LOST.found(lost)
    if numbers.rate < _MIN_RATE:
        return Cause.RATE_LOW.found(f"a sensor sends only {numbers.rate:.1f} frames a second")
    groups = sorted({*times})
    pause = median_high(b - a for a, b in itertools.pairwise(groups)) if len(groups) > 1 else 0.0
    if pause > max(_HELD_BACK, 3.0 * numbers.period) and len(frames) > 3 * len(groups):
        each = len(frames) / len(groups)
        return Cause.HELD_BACK.found(f"frames come {each:.0f} at a time, every {1e3 * pause:.0f} ms")
    return None
