"""Untouched sensor: what is learned of it over quiet frames, as the zero of what a touch adds.

The design's currents will not do: a sheet resistance that is 2 % off would hide what distinguishes two contacts from
one. Both currents are kept over the supply, which cancels its drift. Where the amplifier's zero creeps, by what the
touch phase reads without a current, they go with it.

A dead touch phase reads 0 for ever, and so does an untouched sensor. But nothing joins the layers then, so no guide may
have a potential, and the guides of a phase cannot differ. A leak that grows slowly is learned. What comes suddenly is a
contact, and without a rise of the level it is one that the touch phase does not see.

Damp joins the layers everywhere a little. To the electrodes that leak is a contact matrix as any contact is, and the
matrices of weak contacts add. So a touch is what is left of the whole. This is for the place alone: no threshold is
compared with what is left, so that no press is lost by it, however slowly it comes.
"""

from __future__ import annotations

import math
from typing import Final

from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

from .contact_matrix import ContactMatrix, FrameInversion
from .faults import Fault
from .settings import DetectorSettings

# frames that are averaged at once; noise that lasts as long, as mains hum, shows in the means
CURRENT_BLOCK: Final = 32
_CURRENT_MEMORY: Final = 64  # blocks that the mean remembers
_FREE_BLOCKS: Final = 8  # blocks in which it is found; from then on its drift is bounded
_PRIOR_BLOCKS: Final = 16  # blocks that the noise taken from the start counts for
_PRIOR_NOISE: Final = 0.7  # counts; standard deviation that is assumed at the start
_ROUNDING_VARIANCE: Final = 1.0 / 12.0  # counts^2; variance of rounding alone
_CURRENT_JUMP: Final = 0.01  # ratio; an untouched current that is off by this has changed
_JUMP_DEVIATIONS: Final = 8.0
_ALIKE_SHARE: Final = 0.5  # of the larger change; with more than this the other one has the same cause
# ratio, by which a sheet may change over the other one, and both, by warmth and damp. PEDOT:PSS, the worst, has .77 % a
# kelvin (Wang et al. 2020); two layers on each other differ by 1 K or so, a room and an arm by 30 K
_ONE_DRIFT: Final = 0.015
_ZERO_ERROR: Final = 2.0  # counts, by which the zeros of two days may differ unseen
_BOTH_DRIFT: Final = 0.25
_ZERO_CHANGE: Final = 0.4  # counts, of the mean of a block; less is noise of where no current flows
_ZERO_DEVIATIONS: Final = 4.0
_THRESHOLD_DEVIATIONS: Final = 7.0  # standard deviations from what noise reaches to a threshold: once in 1e11 frames
_MAX_GUIDE_THRESHOLD: Final = 0.03  # part of the supply; the least threshold, on a guide, is raised by noise no further


class UntouchedCurrents:
    """The two drive currents of an untouched sensor.

    Args:
        drift: fastest change that is followed once they are known, as a ratio of the current [1/s].

    Attributes:
        means: the frames that they stand for, 0 before the first block (nothing is known), and the drive currents of
            the radial and of the angular phase over the supply [counts over counts].
        noise: standard deviation of a reading, rounding included [counts].
        spread: of (angular - aspect^2 radial), the variance from frame to frame, as the means of blocks show it, and
            the largest error that averaging cannot remove: rounding where there is no noise.
        aspect: length of the sheet over its breadth, in the rectangle of the field.
    """

    def __init__(self, sensor: Sensor, drift: float) -> None:
        self.aspect = sensor.radial_ohms / sensor.upper_sheet_ohms
        self._weight = self.aspect * self.aspect
        self._drift = drift
        self._sensor, self._inversion, self._known = sensor, FrameInversion(sensor), sensor.known_ohms
        parts = sensor.electronics
        supply = parts.supply_volts / parts.adc_volts * parts.full_count
        variance = (_PRIOR_NOISE * _PRIOR_NOISE + _ROUNDING_VARIANCE) * (1.0 + self._weight**2) / supply**2
        self.noise = math.sqrt(_PRIOR_NOISE * _PRIOR_NOISE + _ROUNDING_VARIANCE)
        limits, bounds = sensor.thresholds, sensor.bounds
        current = min(bounds.radial_low, bounds.angular_low) * (1.0 / limits.current_low - 1.0)
        guide = min(_MAX_GUIDE_THRESHOLD, math.sqrt(2.0) * (limits.touch_level - limits.release_level)) * supply
        self._one_drift = _ONE_DRIFT + _ZERO_ERROR * limits.current_low / min(bounds.radial_low, bounds.angular_low)
        self._per_guide = bounds.touch_current_per_guide
        self._noisiest = min(guide, current) / _THRESHOLD_DEVIATIONS  # counts
        self.spread, self.means = (variance, 0.0), (0, 0.0, 0.0)
        self._newest = 0.0, 0.0  # mixed means, and zero, of the newest block
        self.skip()

    def sheets(self) -> tuple[float, float]:
        """Return the conductances of the upper and the lower sheet [S]; the design's until they have been seen."""
        _, radial, angular = self.means
        if not radial:
            return 1.0 / self._sensor.radial_ohms, 1.0 / self._sensor.angular_ohms
        return self._inversion.untouched(radial, angular)

    def restart(self) -> None:
        """Learn the currents anew. The noise stays known."""
        _, radial, angular = self.means
        self.means = 0, radial, angular
        self.skip()

    def skip(self) -> None:
        """Forget the block that was under way: the sensor is not quiet any more."""
        self._block = 0, 0.0, 0.0, 0.0  # frames, and the sums of what they say

    def feed(self, frame: Frame, period: float) -> tuple[Fault, str] | None:
        """Take the currents of a quiet frame.

        Args:
            period: time from frame to frame [s].

        Returns:
            a fault, where a current has changed suddenly, or where there is more noise than thresholds bear, and what.
        """
        count, zero, radial, angular = self._block
        count += 1
        zero += frame[8] - (frame[6] + frame[7]) * self._per_guide
        radial += frame[11] / frame[16]
        angular += frame[14] / frame[17]
        self._block = count, zero, radial, angular
        return None if count < CURRENT_BLOCK else self._close(frame[15], period)

    def _close(self, supply: int, period: float) -> tuple[Fault, str] | None:
        (_, sum0, sum1, sum2), (frames, radial, angular), (last, known) = self._block, self.means, self._newest
        zero, mean1, mean2 = sum0 / CURRENT_BLOCK, sum1 / CURRENT_BLOCK, sum2 / CURRENT_BLOCK
        self.skip()
        mixed = mean2 - self._weight * mean1
        blocks = frames // CURRENT_BLOCK
        if not blocks:
            radial, angular, last, known = mean1, mean2, mixed, zero
        elif abs(zero - known) > max(_ZERO_CHANGE, _ZERO_DEVIATIONS * self.noise / math.sqrt(CURRENT_BLOCK)):
            crept = (zero - known) / supply
            radial, angular, known = radial + crept, angular + crept, zero
            last += (1.0 - self._weight) * crept
        limit = _JUMP_DEVIATIONS * math.sqrt(self.spread[0] / CURRENT_BLOCK)
        step1, step2 = mean1 - radial, mean2 - angular
        upper, lower = max(_CURRENT_JUMP * radial, limit), max(_CURRENT_JUMP * angular, limit)
        if abs(step1) > upper or abs(step2) > lower:
            self.means, self._newest = (frames, radial, angular), (last, known)
            part1, part2 = step1 / radial, step2 / angular
            where = _changed_sheet(part1, part2)
            return Fault.CURRENT_CHANGED, f"{where}: radial {100.0 * part1:+.2f} %, angular {100.0 * part2:+.2f} %"
        self._learn_noise(mixed - last, supply, blocks)
        self._newest = mixed, known
        blocks = min(blocks + 1, _CURRENT_MEMORY)
        most = self._drift * CURRENT_BLOCK * period if blocks > _FREE_BLOCKS else math.inf
        radial += bounded(step1 / blocks, most * radial)
        angular += bounded(step2 / blocks, most * angular)
        self.means = blocks * CURRENT_BLOCK, radial, angular
        if self.noise > self._noisiest:
            return Fault.NOISE, f"{self.noise:.1f} counts, at most {self._noisiest:.1f}"
        if self._known:
            where, by = compare_sheets(self._known, self._sensor.sheet_ohms(*self.sheets()), self._one_drift)
            if where:
                self._known = ()  # it is told once
                return Fault.CURRENT_CHANGED, f"{where}; {by}: mend it, or calibrate and commission again"
        return None

    def _learn_noise(self, change: float, supply: int, blocks: int) -> None:
        scale = (1.0 + self._weight * self._weight) / (supply * supply)  # from counts^2
        variance = self.spread[0]
        seen = 0.5 * CURRENT_BLOCK * change * change if blocks else variance
        variance = max(variance + (seen - variance) / (_PRIOR_BLOCKS + blocks), _ROUNDING_VARIANCE * scale)
        self.noise = math.sqrt(variance / scale)
        noise = max(0.0, variance / scale - _ROUNDING_VARIANCE)
        # The mean of a rounded value whose noise is Gaussian is off by at most this [counts]; here of two means.
        self.spread = variance, 2.0 / math.pi * math.exp(-2.0 * math.pi * math.pi * noise) * math.sqrt(scale)


def _changed_sheet(upper: float, lower: float) -> str:
    """Return what has changed, by the changes of both sheets' currents or resistances, ratios of any sign."""
    upper, lower = abs(upper), abs(lower)
    if min(upper, lower) > _ALIKE_SHARE * max(upper, lower):
        return "the gain of the current, or both sheets"
    name, electrodes = ("upper", "A or B") if upper > lower else ("lower", "C or D")
    return f"the {name} sheet, or its bond to {electrodes}"


def compare_sheets(
    known: tuple[float, ...], ohms: tuple[float, float], one: float, both: float = _BOTH_DRIFT
) -> tuple[str, str]:
    """Compare a sensor's sheets with what they were known to be.

    Args:
        known: then, upper and lower [ohm per square].
        ohms: now.
        one: by which one may have changed over the other, a ratio.
        both: by which both may.

    Returns:
        what has changed by more, or nothing, and the changes in words.
    """
    upper, lower = ohms[0] / known[0] - 1.0, ohms[1] / known[1] - 1.0
    words = f"ohm per square against those on record: upper {100.0 * upper:+.1f} %, lower {100.0 * lower:+.1f} %"
    good = abs(upper - lower) <= one and max(abs(upper), abs(lower)) <= both
    return "" if good else _changed_sheet(upper, lower), words


def bounded(step: float, most: float) -> float:
    """Return a step, or the largest that is allowed in its direction."""
    return most if step > most else -most if step < -most else step


_ZERO_LIMIT: Final = 0.012  # of full scale, that the zero may be off; 0.8 mV before an amplifier of 50, at 3.3 V
_ZERO_STEP: Final = 1.0  # s, in which it is followed by a unit; by less it may be off: untouched readings end at 0
_ZERO_TIME: Final = 0.5  # s of a look at one that is known: hum of 3 Hz and more goes up and down in it,
# of the time between two of its frames, by which the next is longer: mains stand still in none
_ZERO_TURN: Final = 0.618
_ZERO_SPREAD: Final = 6.0  # units of the middle 80 %, more than the noise that most boards have


class UntouchedZero:
    """The count that a drive current reads where none flows: the bias of its amplifier, and the offset.

    An untouched sensor draws no current in the touch phase, so every frame shows it. It is the median of some:
    where there is no bias, half of the noise is cut off at 0. It is taken off all three drive currents.

    Attributes:
        counts: what is taken off.
        known: it has been seen.
        hidden: the readings have stood at 0, below which they cannot be.
        excess: by how much the newest block was out of the range that is taken off; empty where it was not, or far
            more.
    """

    def __init__(self, sensor: Sensor) -> None:
        parts, bounds = sensor.electronics, sensor.bounds
        self._full = parts.full_count
        self.nominal = self.counts = round(parts.current_zero / parts.current_full_scale * self._full)
        self.most = round(_ZERO_LIMIT * self._full)
        self._unit = max(1, round(self._full / 4095))  # counts: one of 12 bits or less, its share of more
        self._rest = min(self._unit, max(1, int(0.25 * bounds.touch_current_slack)))  # well within what is no leak
        self._per_guide = bounds.touch_current_per_guide
        self._seen: list[float] = []
        self._waited = 0.0, 0.0  # since the zero was moved, and since the newest frame that was looked at [s]
        self.known = self.hidden = False
        self.excess = ""

    def feed(self, frame: Frame, period: float, free: bool) -> bool:
        """Take a frame, as it came, of a sensor that is not touched. Tell whether another zero was found at once.

        Args:
            period: time from frame to frame [s].
            free: nobody relies on the sensor yet: another zero may be taken at once.
        """
        waited, since = self._waited
        waited += period
        since += period
        seen = self._seen
        looked = not self.known or since >= (0.5 + _ZERO_TURN * len(seen) % 1.0) * _ZERO_TIME / CURRENT_BLOCK
        self._waited = waited, 0.0 if looked else since
        if not looked:
            return False
        seen.append(frame.touch_current - (frame.touch_c + frame.touch_d) * self._per_guide)
        if len(seen) < CURRENT_BLOCK:
            return False
        seen.sort()
        median, spread = round(seen[CURRENT_BLOCK // 2]), seen[-CURRENT_BLOCK // 10] - seen[CURRENT_BLOCK // 10]
        free = not self.known or (free and spread < _ZERO_SPREAD * self._unit)  # what swings is followed slowly
        self.known = True
        self.hidden = seen[-1] <= 0.0
        seen.clear()
        off = median - self.nominal
        self.excess = ""
        if self.most < abs(off) <= 4 * self.most:  # beyond, no amplifier is the cause
            self.excess = f"{100.0 * off / self._full:+.2f} % of full scale, at most {100.0 * _ZERO_LIMIT:.1f} %"
        change = median - self.counts
        if not -self.most <= off <= self.most or -self._rest <= change <= self._rest:
            return False
        if free:
            self.counts = median
            return True
        if waited >= _ZERO_STEP:
            self._waited = 0.0, 0.0
            self.counts += max(-self._unit, min(self._unit, change))
        return False

    def lacks(self, frame: Frame) -> bool:
        """Tell whether the zero is below 0, as the current that a frame of a touch lacks shows."""
        lacking = (frame.touch_c + frame.touch_d) * self._per_guide - frame.touch_current
        return self.hidden and frame.touch_current > 0 and self.most < lacking < 4 * self.most

    def take_off(self, frame: Frame) -> Frame:
        """Return a frame whose drive currents are 0 where none flows; one at full scale stays there."""
        zero, full = self.counts, self._full
        touch, radial, angular = (c - zero if c < full else full for c in (frame[8], frame[11], frame[14]))
        values = (*frame[:8], touch, *frame[9:11], radial, *frame[12:14], angular, *frame[15:])
        return tuple.__new__(Frame, values)  # a tenth of the time of frame._replace


# part of the supply; sudden potential of a guide, or difference of two, that nothing explains
_GUIDE_JUMP: Final = 0.01
_MAX_JUMP: Final = 0.03  # part of the supply; what noise raises that to at most
_GUIDE_DEVIATIONS: Final = 7.0  # standard deviations of noise that are no potential
_MAX_GUIDE_GROWTH: Final = 0.1  # parts of the supply a second; the fastest growth that is learned, a leak's
_LEVEL_COUNTS: Final = 1.5  # counts; a change of the level by this explains what the guides show


_HUM_MEMORY: Final = 1.0 / 256.0  # frames; weight of the newest in what the guides swing
_HUM_WEIGHT: Final = 2.0 * _HUM_MEMORY  # an untouched guide stands at 0, so that half of a swing is cut off
_HUM_RATIO: Final = 4.0  # of the variance that the currents' noise leaves on two guides; more is hum


class UntouchedGuides:
    """The potentials that the guides of an untouched sensor have by a leak between the layers, and by mains.

    Args:
        currents: of the untouched sensor, with the noise that was learned.
    """

    def __init__(self, currents: UntouchedCurrents) -> None:
        self._currents = currents
        self._rest = 0.0, 0.0, math.inf  # potentials in the radial and the angular phase, and the level: not yet known
        self._hum = 0.0, 0.0  # variances of the two guides' mean in these phases, over the supply squared

    def hum(self, supply: float) -> tuple[float, float]:
        """Return the variances of X and Y by what swings on the guides and not on the currents; 0 where none does.

        Args:
            supply: of a phase [counts].
        """
        noise = self._currents.noise / supply
        least = 0.5 * _HUM_RATIO * noise * noise
        radial, angular = self._hum
        return radial if radial > least else 0.0, angular if angular > least else 0.0

    def contradict(self, frame: Frame, level: float, period: float) -> bool:
        """Tell whether the guides show a contact that the level does not.

        Args:
            frame: one whose level is below the release threshold.
            level: its level.
            period: time from frame to frame [s].
        """
        c, d, a, b, supply = frame[9], frame[10], frame[12], frame[13], frame[15]
        radial, angular = 0.5 * (c + d) / frame[16], 0.5 * (a + b) / frame[17]
        rest1, rest2, rest = self._rest
        if rest == math.inf:
            self._rest = rest1, rest2, rest = radial, angular, level
        step1, step2 = radial - rest1, angular - rest2
        split1, split2 = c - d, a - b
        differ = _GUIDE_JUMP * supply
        if (
            step1 > _GUIDE_JUMP
            or step2 > _GUIDE_JUMP
            or not (-differ <= split1 <= differ and -differ <= split2 <= differ)
        ):
            return (level - rest) * supply < _LEVEL_COUNTS and self._exceed_noise(
                step1, step2, split1 / supply, split2 / supply, supply
            )
        hum1, hum2 = self._hum
        most = _MAX_GUIDE_GROWTH * period
        hum1 += _HUM_WEIGHT * step1 * step1 - _HUM_MEMORY * hum1
        hum2 += _HUM_WEIGHT * step2 * step2 - _HUM_MEMORY * hum2
        self._hum = hum1, hum2
        rest += bounded(0.1 * (level - rest), most)  # a step of the noise is not followed
        self._rest = rest1 + bounded(step1, most), rest2 + bounded(step2, most), rest
        return False

    def _exceed_noise(self, step1: float, step2: float, split1: float, split2: float, supply: int) -> bool:
        """Tell whether steps, or differences, are more than noise leaves in as many readings."""
        noise = _GUIDE_DEVIATIONS * self._currents.noise / supply
        step, split = (
            min(max(0.7 * noise, _GUIDE_JUMP), _MAX_JUMP),
            min(max(1.4 * noise, _GUIDE_JUMP), _MAX_JUMP),
        )
        return step1 > step or step2 > step or abs(split1) > split or abs(split2) > split


LEAK_BLOCK: Final = 32  # frames that are averaged before they are inverted
_LEAK_MEMORY: Final = 16  # blocks that the mean remembers
_MIN_LEAK_LEVEL: Final = 1e-3  # a leak that shows less does nothing to a touch: 5 Mohm with 10 kohm pull-downs
_MIN_LEAK: Final = 1e-7  # S; 10 Mohm are what the converter's own inputs are
_MAX_LEAK_SHARE: Final = 0.5  # of the whole conductance; where the leak is more, a touch is too weak for a place


class UntouchedLeak:
    """The leak of one sensor.

    Args:
        sensor: the sensor.
        largest: conductance that is learned at most [S]. What is more is not a leak.

    Attributes:
        conductance: of the leak [S], 0 where there is none.
        x: its electrical centre, as in ContactMatrix.
        y: the same around.
    """

    def __init__(self, sensor: Sensor, largest: float) -> None:
        self._inversion = FrameInversion(sensor)
        self._largest = largest
        self._frames: list[Frame] = []
        self._blocks = 0
        self.conductance = self.x = self.y = 0.0

    def skip(self) -> None:
        """Forget the block that was under way: the sensor is not quiet any more."""
        if self._frames:
            self._frames.clear()

    def feed(self, frame: Frame, level: float) -> None:
        """Take a quiet frame and its level."""
        if level < _MIN_LEAK_LEVEL and not self.conductance:
            return  # a dry sensor, and nothing to learn
        self._frames.append(frame)
        if len(self._frames) >= LEAK_BLOCK:
            self._close()

    def _close(self) -> None:
        means = [sum(counts) / LEAK_BLOCK for counts in zip(*[frame[6:18] for frame in self._frames], strict=True)]
        self._frames.clear()
        matrix = self._inversion.invert(means)
        self._blocks = min(self._blocks + 1, _LEAK_MEMORY)
        share = 1.0 / self._blocks
        if matrix is None or matrix.conductance < _MIN_LEAK:
            self.conductance -= share * self.conductance
            return
        known, seen = (1.0 - share) * self.conductance, share * min(matrix.conductance, self._largest)
        total = known + seen
        self.x, self.y = (known * self.x + seen * matrix.x) / total, (known * self.y + seen * matrix.y) / total
        self.conductance = total

    def take_off(self, matrix: ContactMatrix) -> ContactMatrix:
        """Return the contact matrix of the touch alone.

        The learned untouched currents contain the leak's own part of ``along`` and ``around``. What is taken off here
        is the part of the distance between leak and touch.
        """
        leak, whole = self.conductance, matrix.conductance
        if leak < _MIN_LEAK or leak > _MAX_LEAK_SHARE * whole:
            return matrix
        touch = whole - leak
        off_x, off_y = matrix.x - self.x, matrix.y - self.y
        ratio = leak / touch
        pull = ratio * whole  # G_c G_l/G (X_c - X_l)^2, with X_c - X_l = (X - X_l) G/G_c
        return matrix._replace(
            conductance=touch,
            x=matrix.x + ratio * off_x,
            y=matrix.y + ratio * off_y,
            along=matrix.along - pull * off_x * off_x,
            cross=matrix.cross - pull * off_x * off_y,
            around=matrix.around - pull * off_y * off_y,
        )


class UntouchedLevel:
    """The level that a sensor has while nothing touches it.

    Args:
        settings: how fast it may drift, and how far.
        release: level below which nothing touches the sensor.

    Attributes:
        value: what is taken off each level.
    """

    def __init__(self, settings: DetectorSettings, release: float) -> None:
        self._rate, self._limit, self._settle_frames = settings.drift_rate, settings.drift_limit, settings.settle_frames
        self._release = release
        self.value = 0.0
        self._drifted = 0

    def exhausted(self, whole: float) -> bool:
        """Tell whether a frame's whole level rests above the threshold though all was taken off that may be.

        A touch passes this range. A growing leak rests in it.
        """
        if abs(self.value) >= self._limit and whole > self._release:
            self._drifted += 1
            return self._drifted >= self._settle_frames
        self._drifted = 0
        return False

    def update(self, level: float, period: float) -> None:
        """Follow the drift.

        Args:
            level: of a frame in which nothing shows, less ``value``.
            period: time from frame to frame [s].
        """
        self.value = bounded(self.value + bounded(level, self._rate * period), self._limit)
