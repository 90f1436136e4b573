"""Place of one touch after another: sharpened frame by frame while it rests, with what is known of its certainty.

The frame that begins a touch gives its electrical centre alone: nothing that stops an arm waits for more. The estimate
with its covariance comes with the next frame, and is made anew only now and then. While the touch rests, the contact
matrices of its frames are averaged, so that the noise of the place falls with the root of their number; where it moves,
they begin anew. The learned untouched currents are the same in all frames, and what they are worth does not average
away.
"""

from __future__ import annotations

import math

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix, FrameInversion
from coneskin.skin.detection.frame.reading import Reading
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.frame.touch_reading import TouchReading
from coneskin.skin.detection.untouched.currents import UntouchedCurrents
from coneskin.skin.detection.untouched.leak import UntouchedLeak
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

from .doubt import CONTRADICTS, MOVES, WEAK
from .matrix_mean import MEAN_FRAMES, MatrixMean
from .matrix_noise import FrameNoise, MatrixNoise
from .place_estimate import PlaceEstimate, PlaceEstimator, SheetConductances
from .seam_certainty import SeamCertainty
from .seam_contact import SeamPlace
from .single_contact import SingleContactTest
from .touch_velocity import TouchVelocity

__all__ = ["TouchPlace"]

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

    __slots__ = (
        "_began",
        "_begun",
        "_count_variance",
        "_currents",
        "_drift",
        "_estimate",
        "_estimator",
        "_first_x",
        "_first_y",
        "_harder",
        "_inversion",
        "_leak",
        "_level",
        "_made_of",
        "_map",
        "_mean",
        "_newest",
        "_next",
        "_noise",
        "_of_frame",
        "_rest",
        "_scale",
        "_seam",
        "_settle",
        "_single",
        "_slide",
        "_softer",
        "_told",
        "_velocity",
    )

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
        self._mean, self._velocity = MatrixMean(), TouchVelocity(self._estimator)
        self._noise: MatrixNoise | None = None
        self._softer = self._harder = 0.0
        self._begun = False
        self._began = 0.0
        self._newest: tuple[float, float] | None = None
        self._first_x = self._first_y = 0.0
        self._restart()

    @property
    def inversion(self) -> FrameInversion:
        """The inversion of the sensor's frames."""
        return self._inversion

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
        doubt = self._doubt(reading, matrix, level, u) or MOVES
        return TouchReading(now, level, u, phi, False, doubt, frame.clock_us, frame.sequence)

    def take(self, frame: Frame, reading: Reading, level: float, now: float, period: float) -> TouchReading:
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
        whole, x, y = mean.take(matrix, noise)
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
        doubt = self._doubt(reading, matrix, level, u)
        if doubt and self._seam.closes and (seam := self._over_seam(reading, matrix, now)) is not None:
            doubt = seam.doubt
            return TouchReading(
                *(now, level, seam.u, seam.phi, not doubt, doubt, frame.clock_us, frame.sequence),
                *(seam.covariance, None, None, seam.elongation, self._velocity.follow(matrix, self._noise, period)),
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
            self._velocity.follow(matrix, self._noise, period),
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
        self._next = frames * _REFRESH_RATIO if frames < MEAN_FRAMES else math.inf
        return estimate

    def _noise_of(self, matrix: ContactMatrix, frame: Frame) -> MatrixNoise:
        return self._of_frame.of(matrix, frame, self._currents.variance * self._count_variance)

    def _sheets(self, now: float) -> SheetConductances:
        """Return the sheets as they were learned; while a touch lasts they may drift unseen."""
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

    def _doubt(self, reading: Reading, matrix: ContactMatrix, level: float, u: float) -> str:
        """Return why the place is not certain; empty where it is."""
        if not reading.location_valid:
            self._newest = None
            return WEAK if reading.level < self._level else CONTRADICTS
        x, y, before = matrix.x, matrix.y, self._newest
        along, around = self._scale  # distances are never too small
        off_x, off_y = along * (x - self._first_x), around * (y - self._first_y)
        if not self._begun or off_x * off_x + off_y * off_y > self._slide:
            self._single.begin()
            self._begun, self._first_x, self._first_y = True, x, y
        self._newest = x, y
        doubt = self._single.take(matrix, level, u)
        if before is None:
            return doubt or MOVES
        off_x, off_y = along * (x - before[0]), around * (y - before[1])
        return doubt or MOVES if off_x * off_x + off_y * off_y > self._settle else doubt

    def _over_seam(self, reading: Reading, matrix: ContactMatrix, now: float) -> SeamPlace | None:
        """Return the place of a press over the seam, and why it is not certain; None where it is none."""
        noise, mean = self._noise, self._mean
        if noise is None or not self._seam.may_be(mean.values):
            self._seam.interrupt()
            return None
        whole = ContactMatrix(*mean.values, 0.0, 0.0, 0.0)
        frames, sheets = float(mean.frames), self._sheets(now)
        return self._seam.follow(whole, noise, frames, sheets, matrix.conductance, reading.location_valid)
