"""Place of one touch after another: sharpened frame by frame while it rests, with what is known of its certainty.

The frame that begins a touch gives its electrical centre alone: nothing that stops an arm waits for more. The estimate
with its covariance comes with the next frame, and is made anew only now and then. While the touch rests, the contact
matrices of its frames are averaged, so that the noise of the place falls with the root of their number. Where it moves,
the mean starts over. The learned untouched currents are the same in all frames, so their error does not average away.
"""

from __future__ import annotations

import math

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix, FrameInversion, FrameNoise, MatrixNoise
from coneskin.skin.detection.frame.reading import Reading, TouchReading
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.frame.untouched import UntouchedCurrents, UntouchedLeak
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

from .place_estimate import PlaceEstimate, PlaceEstimator, SheetConductances
from .seam_contact import SeamCertainty, SeamPlace
from .single_contact import CONTRADICTS, MOVES, WEAK, SingleContactTest

__all__ = [
    "TouchPlace",
]

_MEAN_FRAMES = 128  # frames; the average reaches back so far
_SMOOTHING_GAIN = 0.125  # of the distance to the mean; its variance is 1/15 of a frame's
_SMOOTHED_VARIANCE = _SMOOTHING_GAIN / (2.0 - _SMOOTHING_GAIN)
_MOVED_VARIANCE = 16.0  # four standard deviations, squared: once in 16 000 independent frames by chance
_JUMPED_VARIANCE = 36.0  # six, of one frame alone


class _MatrixMean:
    """The mean of the matrices of one touch after another.

    Attributes:
        frames: in the mean, 1 where it has just begun anew, 0 before the first.
        values: the first six of a ``ContactMatrix``, averaged.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget all matrices."""
        self.frames = 0
        self.values = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self._smooth_x = self._smooth_y = 0.0

    def begin(self, matrix: ContactMatrix) -> None:
        """Begin with the matrix of a frame with which a touch may begin. How far the last ones lay apart is kept."""
        self.frames, self.values = 1, matrix[:6]

    def feed(self, matrix: ContactMatrix, noise: MatrixNoise) -> tuple[float, float, float]:
        """Take a matrix into the mean, or begin a new mean with it where the touch has moved. Return its G, X, Y."""
        frames = self.frames
        g, x, y, along, cross, around = self.values
        new = matrix[:6]
        new_g, new_x, new_y, new_along, new_cross, new_around = new
        if frames:
            off_x, off_y = new_x - x, new_y - y
            smooth_x, smooth_y = self._smooth_x, self._smooth_y
            self._smooth_x = smooth_x = smooth_x + _SMOOTHING_GAIN * (off_x - smooth_x)
            self._smooth_y = smooth_y = smooth_y + _SMOOTHING_GAIN * (off_y - smooth_y)
            share, xx, yy = 1.0 / frames, noise.xx, noise.yy
            alone, smooth = _JUMPED_VARIANCE * (1.0 + share), _MOVED_VARIANCE * (_SMOOTHED_VARIANCE + share)
            if (
                smooth_x * smooth_x > smooth * xx
                or smooth_y * smooth_y > smooth * yy
                or off_x * off_x > alone * xx
                or off_y * off_y > alone * yy
            ):
                frames = 0
        if not frames:
            self.frames, self.values = 1, new
            self._smooth_x = self._smooth_y = 0.0
            return new_g, new_x, new_y
        if frames < _MEAN_FRAMES:
            self.frames = frames = frames + 1
        gain = 1.0 / frames
        g, x, y = g + gain * (new_g - g), x + gain * (new_x - x), y + gain * (new_y - y)
        self.values = (
            g,
            x,
            y,
            along + gain * (new_along - along),
            cross + gain * (new_cross - cross),
            around + gain * (new_around - around),
        )
        return g, x, y


_POSITION_REST, _VELOCITY_GAIN = 0.8, 0.02  # critically damped
_VELOCITY_NOISE = 0.035  # of a frame's noise over the period; what the filter leaves
_MIN_VELOCITY_VARIANCE = (5.0 * _VELOCITY_NOISE) ** 2  # five standard deviations, squared; what is less is no velocity
_NO_VELOCITY = (0.0, 0.0)


class _TouchVelocity:
    """The velocity of one touch after another.

    Args:
        estimator: of the sheet. It says how long and broad it is.
    """

    def __init__(self, estimator: PlaceEstimator) -> None:
        self._length, self._breadth, self._curvature = estimator.length, estimator.breadth, estimator.curvature
        self._track: tuple[float, float, float, float] | None = None

    def restart(self) -> None:
        """Forget the touch."""
        self._track = None

    def feed(self, matrix: ContactMatrix, noise: MatrixNoise | None, period: float) -> tuple[float, float]:
        """Return the velocity along the side and around [m/s]. Zeros where noise explains what moved."""
        track = self._track
        if track is None or noise is None or not period > 0.0:
            self._track = matrix.x, matrix.y, 0.0, 0.0
            return _NO_VELOCITY
        x, y, step_x, step_y = track
        new_x, new_y = matrix.x, matrix.y
        off_x, off_y = new_x - x - step_x, new_y - y - step_y
        step_x, step_y = step_x + _VELOCITY_GAIN * off_x, step_y + _VELOCITY_GAIN * off_y
        x, y = new_x - _POSITION_REST * off_x, new_y - _POSITION_REST * off_y
        self._track = x, y, step_x, step_y
        if step_x * step_x < _MIN_VELOCITY_VARIANCE * noise.xx and step_y * step_y < _MIN_VELOCITY_VARIANCE * noise.yy:
            return _NO_VELOCITY
        on_sheet = min(max(x, 0.0), 1.0)  # hostile counts put a centre anywhere
        stretch = math.exp(self._curvature * on_sheet * self._length) / period
        return step_x * self._length * stretch, step_y * self._breadth * stretch


_MAX_SLIDE = 2.0  # settle distances; a touch that has moved this far is another one, and its evidence begins anew

_REFRESH_RATIO = 1.25  # ratio of frames at which the estimate is made anew
_REFRESH_FRAMES = 8  # frames for which an estimate serves at least; it costs as much as five of them
_SOLVE_STEP = 0.1  # ratio by which the conductance may change before it is
_UNLEARNED_ERROR = 0.05  # ratio; the sheets' conductance where none was learned yet

_NO_DETAILS = (None, None, None)  # of covariance, radius and its deviation
_Details = tuple[tuple[float, float, float] | None, float | None, float | None]


class TouchPlace:
    """The places of the touches of one sensor.

    Args:
        sensor: the sensor.
        settings: how far a place may move while it is certain, and what a single contact is.
        currents: of the untouched sensor.
        leak: between its layers, which is no part of a touch.
    """

    def __init__(
        self, sensor: Sensor, settings: DetectorSettings, currents: UntouchedCurrents, leak: UntouchedLeak
    ) -> None:
        cone, parts = sensor.frustum, sensor.electronics
        self._inversion, self._of_frame = FrameInversion(sensor), FrameNoise(sensor)
        self._estimator = PlaceEstimator(sensor)
        self._single = SingleContactTest(sensor, settings, currents)
        self._currents, self._drift = currents, settings.current_drift
        self._map, self._leak = sensor.place_map, leak
        self._level = sensor.thresholds.location_level
        self._settle = settings.settle_distance**2
        self._slide = (_MAX_SLIDE * settings.settle_distance) ** 2
        widest = max(cone.radius1, cone.radius2)
        self._scale = self._estimator.length * widest / cone.radius1, cone.wrap * widest
        self._seam = SeamCertainty(sensor, settings, self._estimator, self._scale[1])
        supply = parts.supply_volts / parts.adc_volts * parts.full_count
        self._count_variance = supply * supply / (1.0 + currents.aspect**4)
        self._mean, self._velocity = _MatrixMean(), _TouchVelocity(self._estimator)
        self._noise: MatrixNoise | None = None
        self._softer = self._harder = 0.0
        self._begun = False
        self._began = 0.0
        self._newest: tuple[float, float] | None = None
        self._first_x = self._first_y = 0.0
        self._restart()

    def end(self) -> None:
        """Forget the touch: it is over."""
        self._begun, self._newest = False, None
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
            reading: what it says.
            level: its level, the drift taken off.
            now: host clock [s].
        """
        matrix = self._contacts(reading)
        if matrix is None:
            return TouchReading(now, level, 0.0, 0.0, False, WEAK, frame.clock_us, frame.sequence)
        self._began = now
        self._mean.begin(matrix)
        u, phi = self._estimator.place(matrix.x, matrix.y, 0.0, 0.0)
        if self._map is not None:
            u, phi = self._map.apply(u, phi)
        doubt = self._doubt(reading, matrix, level, u, None) or MOVES
        return TouchReading(now, level, u, phi, False, doubt, frame.clock_us, frame.sequence)

    def feed(self, frame: Frame, reading: Reading, level: float, now: float, period: float) -> TouchReading:
        """Take a frame of a touch that has begun.

        Args:
            frame: a valid one.
            reading: what it says.
            level: its level, the drift taken off.
            now: host clock [s].
            period: time from frame to frame [s].
        """
        matrix = reading.matrix
        if matrix is None or self._leak.conductance:
            matrix = self._contacts(reading)
        if matrix is None:
            return TouchReading(now, level, 0.0, 0.0, False, WEAK, frame.clock_us, frame.sequence)
        mean, noise = self._mean, self._noise
        if not mean.frames:
            self._began = now
        if noise is None:
            self._noise = noise = self._noise_of(matrix, frame)
        whole, x, y = mean.feed(matrix, noise)
        frames = mean.frames
        if frames == 1:
            self._next = 1.0
        estimate = self._estimate
        steady = frames >= self._made_of and self._softer < whole < self._harder
        self._rest -= 1
        if estimate is None or (self._rest <= 0 and (frames >= self._next or not steady)):
            estimate, steady = self._solve(frame, now), True
        u, phi = self._estimator.place(x, y, estimate.move_x, estimate.move_y)
        if self._map is not None:
            u, phi = self._map.apply(u, phi)
        doubt = self._doubt(reading, matrix, level, u, estimate)
        if doubt and self._seam.closes and (seam := self._over_seam(reading, matrix, now)) is not None:
            doubt = seam.doubt
            return TouchReading(
                *(now, level, seam.u, seam.phi, not doubt, doubt, frame.clock_us, frame.sequence),
                *(seam.covariance, None, None, seam.elongation, self._velocity.feed(matrix, self._noise, period)),
            )
        covariance, radius, deviation = self._told if steady else _NO_DETAILS
        return TouchReading(
            now,
            level,
            u,
            phi,
            not doubt,
            doubt,
            frame.clock_us,
            frame.sequence,
            covariance,
            radius,
            deviation,
            self._single.elongation(whole) if doubt else None,
            self._velocity.feed(matrix, self._noise, period),
        )

    def _contacts(self, reading: Reading) -> ContactMatrix | None:
        """Return what the contacts are to the electrodes, the leak taken off."""
        matrix = reading.matrix
        if matrix is None:
            self._newest = None
            return None
        return self._leak.take_off(matrix) if self._leak.conductance else matrix

    def _restart(self) -> None:
        self._mean.restart()
        self._made_of = self._rest = 0
        self._next = 1.0
        self._softer = self._harder = 0.0
        self._told: _Details = _NO_DETAILS
        self._noise = None
        self._estimate: PlaceEstimate | None = None
        self._velocity.restart()

    def _solve(self, frame: Frame, now: float) -> PlaceEstimate:
        """Make the estimate anew."""
        mean, frames = ContactMatrix(*self._mean.values, 0.0, 0.0, 0.0), self._mean.frames
        noise = self._noise
        if frames == 1 or noise is None:
            self._noise = noise = self._noise_of(mean, frame)
        estimate = self._estimator.estimate(mean, noise, float(frames), self._sheets(now))
        if self._map is not None:
            estimate = self._mapped(estimate)
        dipole, covariance = estimate.dipole, (estimate.uu, estimate.us, estimate.ss)
        identified = dipole.log_radius_deviation < 0.5
        radius = (math.exp(dipole.log_radius), dipole.log_radius_deviation) if identified else (None, None)
        self._told = covariance, *radius
        self._softer, self._harder = (
            (1.0 - _SOLVE_STEP) * mean.conductance,
            (1.0 + _SOLVE_STEP) * mean.conductance,
        )
        self._estimate, self._made_of, self._rest = estimate, frames, _REFRESH_FRAMES
        self._next = frames * _REFRESH_RATIO if frames < _MEAN_FRAMES else math.inf
        return estimate

    def _noise_of(self, matrix: ContactMatrix, frame: Frame) -> MatrixNoise:
        return self._of_frame.of(matrix, frame, self._currents.variance * self._count_variance)

    def _sheets(self, now: float) -> SheetConductances:
        """Return the sheets as they were learned. While a touch lasts they may drift unseen."""
        currents = self._currents
        if not currents.frames:
            upper, lower = self._estimator.sheets
            return SheetConductances(upper, lower, (_UNLEARNED_ERROR * upper) ** 2, (_UNLEARNED_ERROR * lower) ** 2)
        upper, lower = self._inversion.untouched(currents.radial, currents.angular)
        one = currents.variance / (1.0 + currents.aspect**4) / currents.frames + currents.bias**2
        ratio = one / currents.radial**2, one / currents.angular**2
        drift = (self._drift * (now - self._began)) ** 2
        return SheetConductances(upper, lower, upper * upper * (ratio[0] + drift), lower * lower * (ratio[1] + drift))

    def _mapped(self, estimate: PlaceEstimate) -> PlaceEstimate:
        """Carry the covariance through the calibration's map."""
        assert self._map is not None
        radius = self._map.frustum.radius_at(estimate.u)
        (uu, up), (pu, pp) = self._map.jacobian(estimate.u, estimate.phi)
        us, su = up / radius, pu * radius
        a, b, c = estimate.uu, estimate.us, estimate.ss
        return estimate._replace(
            uu=uu * uu * a + 2.0 * uu * us * b + us * us * c,
            us=uu * su * a + (uu * pp + us * su) * b + us * pp * c,
            ss=su * su * a + 2.0 * su * pp * b + pp * pp * c,
        )

    def _doubt(
        self, reading: Reading, matrix: ContactMatrix, level: float, u: float, estimate: PlaceEstimate | None
    ) -> str:
        """Return why the place is not certain. Empty where it is."""
        if not reading.location_valid:
            self._newest = None
            return WEAK if reading.level < self._level else CONTRADICTS
        x, y, before = matrix.x, matrix.y, self._newest
        along, around = self._scale  # distances are never too small
        off_x, off_y = along * (x - self._first_x), around * (y - self._first_y)
        single = self._single
        if not self._begun or off_x * off_x + off_y * off_y > self._slide:
            single.begin()
            self._begun, self._first_x, self._first_y = True, x, y
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
        noise, mean = self._noise, self._mean
        if noise is None or not self._seam.may_be(mean.values):
            self._seam.interrupt()
            return None
        whole = ContactMatrix(*mean.values, 0.0, 0.0, 0.0)
        frames, sheets = float(mean.frames), self._sheets(now)
        return self._seam.feed(whole, noise, frames, sheets, matrix.conductance, reading.location_valid)
