"""Place of one touch after another: sharpened frame by frame while it rests, with what is known of its certainty.

The frame that begins a touch gives its electrical centre alone: nothing that stops an arm waits for more. The estimate
with its covariance comes with the next frame, and is made anew only now and then. Between, a filter follows the touch
(``touch_filter``). The learned untouched currents are the same in all frames, and so is what the sheets are not as they
should be (``tolerance``): their part of the covariance does not fall with the number of frames.
"""

from __future__ import annotations

import math
from typing import Final

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix, FrameNoise, MatrixNoise
from coneskin.skin.detection.frame.reading import Reading, TouchReading
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.frame.untouched import UntouchedCurrents, UntouchedGuides, UntouchedLeak
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

from .place_estimate import PlaceEstimate, PlaceEstimator, SheetConductances
from .seam_contact import SeamCertainty, SeamPlace
from .single_contact import ALTERED, CONTRADICTS, DANGEROUS_ANGLE, MOVES, WEAK, SingleContactTest
from .touch_filter import TouchFilter

_FLOOR_FRAMES: Final = 128  # frames; no estimate is made anew for more
_HUM_QUARTER: Final = 0.005  # s; of a period of 50 Hz, in which hum is alike
_NORMAL_DEVIATIONS = 3.0  # standard deviations within which the normal of a certain place is known to DANGEROUS_ANGLE
_UNKNOWN_NORMAL: Final = "its normal is not known to 20 degrees: calibrate the sensor"

_MAX_SLIDE = 2.0  # settle distances; a touch that has moved this far is another one, and its evidence begins anew

_REFRESH_RATIO: Final = 1.25  # ratio of frames at which the estimate is made anew
_REFRESH_FRAMES: Final = 8  # frames for which an estimate serves at least; it costs as much as five of them
_SOLVE_STEP: Final = 0.1  # ratio by which the conductance may change before it is
_UNLEARNED_ERROR: Final = 0.05  # ratio; the sheets' conductance where none was learned yet


class TouchPlace:
    """The places of the touches of one sensor.

    Args:
        settings: how far a place may move while it is certain, and what a single contact is.
        currents: of the untouched sensor.
        leak: between its layers, which is no part of a touch.
        guides: of the untouched sensor, with what mains do to them.

    Attributes:
        altered: how a drive current is not what it was; empty while it is. No place is certain from then on.
    """

    def __init__(
        self,
        sensor: Sensor,
        settings: DetectorSettings,
        currents: UntouchedCurrents,
        leak: UntouchedLeak,
        guides: UntouchedGuides,
    ) -> None:
        cone, parts = sensor.frustum, sensor.electronics
        self._of_frame = FrameNoise(sensor)
        self._estimator = PlaceEstimator(sensor)
        self._single = SingleContactTest(sensor, settings, currents)
        self._currents, self._drift = currents, settings.current_drift
        self._map, self._leak, self._guides = sensor.place_map, leak, guides
        self._level = sensor.thresholds.location_level
        self._settle = settings.settle_distance**2
        self._slide = (_MAX_SLIDE * settings.settle_distance) ** 2
        self._radius1, self._taper = cone.radius1, cone.sin_half_angle
        self._loosest = (DANGEROUS_ANGLE / _NORMAL_DEVIATIONS) ** 2
        widest = max(cone.radius1, cone.radius2)
        self._scale = self._estimator.length * widest / cone.radius1, cone.wrap * widest
        self._seam = SeamCertainty(sensor, settings, self._estimator, self._scale[1])
        supply = parts.supply_volts / parts.adc_volts * parts.full_count
        self._mixed = 1.0 + currents.aspect**4
        self._count_variance = supply * supply / self._mixed
        self._filter = TouchFilter(self._scale)
        self._sheet_drift = sensor.tolerance.drift**2
        self._noise: MatrixNoise | None = None
        # frames for which the estimate serves, in all when it is made anew, conductance of which it was made [S]
        self._due: tuple[int, float, float] = 0, 1.0, 0.0
        self.altered = ""
        self._located = self._doubted = False
        self._began = 0.0
        self._newest: tuple[float, float] | None = None
        self._first: tuple[float, float] | None = None  # where its evidence began
        self._restart()

    def end(self) -> None:
        """Forget the touch: it is over."""
        self._located, self._first, self._newest = False, None, None
        self._seam.end()
        self._restart()

    def interrupt(self) -> None:
        """Note a frame that cannot be believed: the next one follows no other."""
        self._newest = None
        self._seam.interrupt()

    def begin(self, frame: Frame, reading: Reading, level: float, now: float) -> TouchReading:
        """Take a frame with which a touch may begin: no estimate is made of it, and so its place is not certain.

        Args:
            frame: a valid one.
            level: its level, the drift taken off.
            now: host clock [s].
        """
        matrix = self._contacts(reading)
        if matrix is None:
            return TouchReading(now, level, 0.0, 0.0, False, WEAK, frame.clock_us, frame.sequence)
        self._began = now
        self._filter.begin(matrix)
        u, phi = self._placed(matrix.x, matrix.y, None)
        doubt = self._doubt(reading, matrix, level, u, None) or MOVES
        return TouchReading(now, level, u, phi, False, doubt, frame.clock_us, frame.sequence)

    def feed(self, frame: Frame, reading: Reading, level: float, now: float, period: float) -> TouchReading:
        """Take a frame of a touch that has begun.

        Args:
            frame: a valid one.
            level: its level, the drift taken off.
            now: host clock [s].
            period: time from frame to frame [s].
        """
        matrix = reading.matrix
        if matrix is None or self._leak.conductance:
            matrix = self._contacts(reading)
        if matrix is None:
            return TouchReading(now, level, 0.0, 0.0, False, WEAK, frame.clock_us, frame.sequence)
        track, noise = self._filter, self._noise
        if not track.frames:
            self._began = now
        if noise is None:
            self._noise = noise = self._noise_of(matrix, frame, period)
        track.feed(matrix, noise, period)
        frames, estimate = track.frames, self._estimate
        whole, x, y, _, _, _ = track.values
        rest, due, solved = self._due
        rest, due = rest - 1, 1.0 if frames == 1 else due
        self._due = rest, due, solved
        steady = abs(whole - solved) < _SOLVE_STEP * solved
        if estimate is None or (rest <= 0 and (frames >= due or not steady)):
            estimate, steady = self._solve(frame, now, period), True
        u, phi = self._placed(x, y, estimate)
        doubt = self._doubt(reading, matrix, level, u, estimate)
        # the first certain place is told with its covariance; a length that a doubtful frame showed is looked at anew
        if not doubt and (not (steady or self._located) or (self._doubted and estimate.line is not None)):
            estimate, steady = self._solve(frame, now, period), True
            u, phi = self._placed(x, y, estimate)
        self._doubted = bool(doubt)
        covariance = estimate.covariance(track.share, track.motion)
        step_x, step_y = track.velocity
        rate = 1.0 / period if period > 0.0 else 0.0
        velocity = step_x * estimate.scale[0] * rate, step_y * estimate.scale[1] * rate
        if doubt and self._seam.closes and (seam := self._over_seam(reading, matrix, now)) is not None:
            doubt = seam.doubt
            return TouchReading(
                *(now, level, seam.u, seam.phi, not doubt, doubt, frame.clock_us, frame.sequence),
                *(seam.covariance, None, None, seam.elongation, velocity),
            )
        wide = self._radius1 + self._taper * u
        if not doubt and covariance[2] > self._loosest * wide * wide:
            doubt = _UNKNOWN_NORMAL
        self._located = self._located or not doubt
        told, line = covariance if steady else None, estimate.line if doubt else None
        radius, deviation = estimate.radius() if steady else (None, None)
        number, clock = frame.sequence, frame.clock_us
        values = now, level, u, phi, not doubt, doubt, clock, number, told, radius, deviation, line, velocity
        return tuple.__new__(TouchReading, values)  # quicker than TouchReading()

    def _placed(self, x: float, y: float, estimate: PlaceEstimate | None) -> tuple[float, float]:
        move_x, move_y = (0.0, 0.0) if estimate is None else (estimate.move_x, estimate.move_y)
        u, phi = self._estimator.place(x, y, move_x, move_y)
        return (u, phi) if self._map is None else self._map.apply(u, phi)

    def _contacts(self, reading: Reading) -> ContactMatrix | None:
        matrix = reading.matrix
        if matrix is None:
            self._newest = None
            return None
        return self._leak.take_off(matrix) if self._leak.conductance else matrix

    def _restart(self) -> None:
        self._filter.restart()
        self._due = 0, 1.0, 0.0
        self._noise = None
        self._estimate: PlaceEstimate | None = None

    def _solve(self, frame: Frame, now: float, period: float) -> PlaceEstimate:
        mean, frames = self._filter.mean(), self._filter.frames
        noise = self._noise
        if frames == 1 or noise is None:
            self._noise = noise = self._noise_of(mean, frame, period)
        estimate = self._estimator.estimate(mean, noise, float(frames), self._sheets(now))
        if self._map is not None:
            estimate = self._mapped(estimate)
        due = frames * _REFRESH_RATIO if frames < _FLOOR_FRAMES else math.inf
        self._estimate, self._due = estimate, (_REFRESH_FRAMES, due, mean.conductance)
        return estimate

    def _noise_of(self, matrix: ContactMatrix, frame: Frame, period: float) -> MatrixNoise:
        noise = self._of_frame.of(matrix, frame, self._currents.spread[0] * self._count_variance)
        hum_x, hum_y = self._guides.hum(frame.radial_supply)
        if not (hum_x or hum_y):
            return noise
        alike = max(1.0, _HUM_QUARTER / period) if period > 0.0 else 1.0  # frames
        return noise._replace(xx=noise.xx + alike * hum_x, yy=noise.yy + alike * hum_y)

    def _sheets(self, now: float) -> SheetConductances:
        """Return the sheets as they were learned. While a touch lasts they may drift unseen."""
        frames, radial, angular = self._currents.means
        variance, bias = self._currents.spread
        upper, lower = self._currents.sheets()
        drift = self._drift * (now - self._began)
        drift = drift * drift + self._sheet_drift
        error1 = error2 = _UNLEARNED_ERROR * _UNLEARNED_ERROR
        if frames:
            one = variance / self._mixed / frames + bias * bias
            error1, error2 = one / (radial * radial) + drift, one / (angular * angular) + drift
        return tuple.__new__(SheetConductances, (upper, lower, upper * upper * error1, lower * lower * error2))

    def _mapped(self, estimate: PlaceEstimate) -> PlaceEstimate:
        """Carry the covariance through the calibration's map."""
        assert self._map is not None
        radius = self._map.frustum.radius_at(estimate.u)
        (uu, up), (pu, pp) = self._map.jacobian(estimate.u, estimate.phi)
        us, su = up / radius, pu * radius

        def turned(by: tuple[float, float, float]) -> tuple[float, float, float]:
            a, b, c = by
            return (
                uu * uu * a + 2.0 * uu * us * b + us * us * c,
                uu * su * a + (uu * pp + us * su) * b + us * pp * c,
                su * su * a + 2.0 * su * pp * b + pp * pp * c,
            )

        return estimate._replace(fixed=turned(estimate.fixed), one=turned(estimate.one))

    def _doubt(
        self, reading: Reading, matrix: ContactMatrix, level: float, u: float, estimate: PlaceEstimate | None
    ) -> str:
        """Return why the place is not certain. Empty where it is."""
        if self.altered:
            return ALTERED
        if not reading.location_valid:
            self._newest = None
            return WEAK if reading.level < self._level else CONTRADICTS
        x, y, before = matrix.x, matrix.y, self._newest
        along, around = self._scale  # distances are never too small
        first_x, first_y = self._first or (x, y)
        off_x, off_y = along * (x - first_x), around * (y - first_y)
        single = self._single
        if self._first is None or off_x * off_x + off_y * off_y > self._slide:
            single.begin()
            self._first = x, y
        self._newest = x, y
        disc = None
        if estimate is not None:
            disc = self._estimator.disc_dipole(single.largest_disc(u), matrix.conductance, estimate.edge)
        doubt = single.feed(matrix, level, u, disc)
        if before is None:
            return doubt or MOVES
        off_x, off_y = along * (x - before[0]), around * (y - before[1])
        return doubt or MOVES if off_x * off_x + off_y * off_y > self._settle else doubt

    def _over_seam(self, reading: Reading, matrix: ContactMatrix, now: float) -> SeamPlace | None:
        """Return the place of a press over the seam, and why it is not certain. None where it is none."""
        noise, mean = self._noise, self._filter
        if noise is None or self.altered or not self._seam.may_be(mean.values):
            self._seam.interrupt()
            return None
        frames, sheets = float(mean.frames), self._sheets(now)
        return self._seam.feed(mean.mean(), noise, frames, sheets, matrix.conductance, reading.location_valid)
