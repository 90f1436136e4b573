"""Place of a contact out of its contact matrix, without the area error, and how certain it is.

The electrical centre of an extended contact is displaced by the images of its own dipole in the sheet's edges
(docs/understand/field.md):

    displacement = -1/2 A grad gamma - (Ru+Rl) kappa/(4 pi) (2 A_xx - A_yy, 3 A_xy)

with A = (P_xx L^2, P_xy L T, P_yy T^2).

P is what the contacts add to the sheets' own conductances, and those are learned while nothing touches. It is small
beside both, so it is never taken as measured: the mean of the polarisability along and around is weighed against that
of a round contact, and its inequality against the little that a round contact has. What a coarse converter says about
the size of a contact therefore moves its place only as far as it is worth.

A round contact of radius a and conductance g per area has, in the rectangle of the field,

    A = (2 pi/Rs) a^2 I_2(ka)/I_0(ka),      1/G = Rs/(2 pi) (c - ln a) + (Robin function),   c = I_0(ka)/(ka I_1(ka))

with k^2 = g Rs. G is measured well, A badly where the converter is coarse. So G leaves one line of pairs (a, g), a
usual radius weighs them, and the measured A weighs them again: A with its variance follows, and ln a. A weak contact
thus has hardly any dipole, whatever its noise says, and a bonded one that of its G.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from coneskin.skin.detection.frame.contact_matrix import ContactMatrix, MatrixNoise
from coneskin.skin.sensor import Sensor
from coneskin.skin.sheet_functions import RobinFunction
from coneskin.skin.tolerance import PlaceFloor

_USUAL_RADIUS: Final = math.log(0.005)  # ln m; radius of a usual contact, a fingertip's
_WEIGHT_RADIUS: Final = 1.0  # of ln a: one over its variance
_MIN_RADIUS: Final = math.log(0.0005)  # ln m
_MAX_RADIUS: Final = math.log(0.03)  # ln m
_WEIGHT_KA: Final = 0.25 / 1.5**2  # of ln (ka)^2: a quarter over the variance of ln ka about 1
_MAX_KA_WEIGHT: Final = 6.0  # a bond has an infinite ka, and is no less usual than this says
_LAST_NODE: Final = 6
_MIN_C: Final = 0.003  # ka of 300: a bond
_MIN_DISC_C: Final = 0.25  # of the largest disc that is one contact; less has a ring of firm contacts, or a larger one
_NODE_WIDTH: Final = 0.35  # of the distance between a node's neighbours
_MODEL_VARIANCE: Final = 0.05**2  # of A^2; no real contact is a uniform disc
_MODEL_RADIUS: Final = 0.1  # of ln a; half the distance of two nodes, and the same


class _DipoleStrength(NamedTuple):
    """A dipole and the contact that it belongs to."""

    strength: float  #: A, mean of the polarisability along and around, as it is corrected for [S m^2]
    variance: float  #: mean square of the distance from that [S^2 m^4]
    gain: float  #: how far it follows what was measured, 0..1
    log_radius: float  #: mean of ln a, a in m
    log_radius_deviation: float  #: standard deviation of ln a


def _disc_share(c: float) -> float:
    """Return f = I_2(ka)/I_0(ka) by c: the dipole of a disc over that of a bond. To .4 %, exact at both ends."""
    return 1.0 / (1 / 3 + 4.0 * c + 2 / 3 / (1.0 + c * (3.0 + 7.0 * c)))


def _weigh_dipole(
    measured: float, variance: float, resistance: float, beyond: float, stretch: float, tolerated: float
) -> _DipoleStrength:
    """Weigh a measured dipole against those that a round contact of the measured conductance can have.

    The strength is not the mean of what is left of them, but what has the smallest error beside that of no correction
    at all. A contact of a millimetre and one of a centimetre can have the same conductance, and dipoles that differ a
    hundredfold: their mean would harm the small one by more than it helps the large one.

    Args:
        measured: mean of the polarisability along and around, in the rectangle [S m^2].
        variance: of it [S^2 m^4].
        resistance: Rs, the two sheets together [ohm per square].
        beyond: spreading resistance less the Robin function, 1/G - gamma, for distances in metres [ohm].
        stretch: of the sheet over the rectangle, at the place.
        tolerated: square of a dipole that displaces the place by as much as its noise does [S^2 m^4].
    """
    k = 2.0 * math.pi / resistance
    shift = k * beyond - math.log(stretch)  # c = ln a + shift
    low = max(_MIN_C, _MIN_RADIUS + shift)
    high = max(_MAX_RADIUS + shift, low + 0.5)
    start = math.sqrt(low)
    step = (math.sqrt(high) - start) / _LAST_NODE
    # exp(2 c) from node to node, c = z^2: its ratios grow by a constant ratio
    least = k / (stretch * stretch) * math.exp(2.0 * (low - shift))
    widening, growth = math.exp(2.0 * step * (start + start + step)), math.exp(4.0 * step * step)
    best = math.inf
    whole = first = second = logs = log_squares = part = parts = 0.0
    # a mixture of normal distributions about the nodes, as wide as these are apart. The first round looks for the
    # likeliest, the second weighs; compiled, working a node out again is quicker than a list of them
    for weighing in (False, True):
        z, power, ratio = start, least, widening
        c = z * z
        before = strength = power * _disc_share(c)
        for number in range(_LAST_NODE + 1):
            node, log_radius, density, after = strength, c - shift, z, strength
            twice = 1.0 + c + c
            off, ka = log_radius - _USUAL_RADIUS, math.log(twice / (c * c))
            ka *= _WEIGHT_KA * ka
            unlikely = _WEIGHT_RADIUS * off * off + (ka if ka < _MAX_KA_WEIGHT else _MAX_KA_WEIGHT)
            if number < _LAST_NODE:
                power *= ratio
                ratio *= growth
                z += step
                c = z * z
                after = strength = power * _disc_share(c)
            gap = _NODE_WIDTH * (after - before)
            before = node
            width = gap * gap + _MODEL_VARIANCE * node * node
            off, gain = measured - node, 1.0 / (width + variance)
            unlikely += off * off * gain
            if not weighing:
                best = min(best, unlikely)
                continue
            mean = node + width * gain * off
            square = width * gain * variance + mean * mean
            # the first is d ln a/dz, but for a factor
            weight = density * math.sqrt(gain) * math.exp(0.5 * (best - unlikely))
            whole += weight
            first += weight * mean
            second += weight * square
            logs += weight * log_radius
            log_squares += weight * log_radius * log_radius
            weight /= tolerated + square
            part += weight
            parts += weight * mean
    share = 1.0 / whole
    strength, mean, square, log_radius = parts / part, first * share, second * share, logs * share
    spread = square - mean * mean
    values = (
        strength,
        spread + (mean - strength) * (mean - strength),
        min(1.0, spread / variance) if variance > 0.0 else 1.0,
        log_radius,
        math.sqrt(max(0.0, log_squares * share - log_radius * log_radius) + _MODEL_RADIUS * _MODEL_RADIUS),
    )
    return tuple.__new__(_DipoleStrength, values)  # quicker than _DipoleStrength()


_REAL_VARIANCE: Final = 4.0**2  # deviations, squared; an inequality below is taken for noise and drift
_ROUND_INEQUALITY: Final = 0.05  # of the dipole; inequality that an edge next to a round contact gives it
# what the multipoles beyond the dipole are, by the dipole's area: of the displacement, over the distance to the edge
# squared; and of the taper, by its curvature squared (root mean squares of the difference to the exact field)
_NEXT_IMAGE, _NEXT_TAPER = 0.02, 0.05
_LONG_INEQUALITY: Final = 0.15  # of the dipole; at an edge a round contact of 15 mm shows .07, two of 5 mm in a row 1.4
_LONG_STEPS: Final = 5  # of the equation for half a length, each with an error of half the one before at most
# deviations of a long contact's middle, of half its length: its parts share the current unevenly, as none can know. One
# with twice the other's conductance is off by .2 to .35 along the line; a bent one, or a taper, moves it across
_UNEVEN_ALONG, _UNEVEN_ACROSS = 0.15, 0.1
_EDGE_MARGIN: Final = 1e-4  # of a side; the edge itself has no gradient
_MAX_STEP: Final = 0.03  # of a side; a displacement is smaller, save of what is no contact


class SheetConductances(NamedTuple):
    """The sheets alone, as learned while nothing touched."""

    upper: float  #: [S]
    lower: float  #: [S]
    upper_variance: float  #: [S^2]
    lower_variance: float  #: [S^2]


class PlaceEstimate(NamedTuple):
    """A place on the sheet with its covariance, where s is the distance around, along the circle."""

    u: float  #: slant distance from end 1 [m]
    phi: float  #: azimuth [rad]
    fixed: tuple[float, float, float]  #: covariances uu, us, ss [m^2] that more frames of the same place leave
    one: tuple[float, float, float]  #: by the noise of one frame's centre
    scale: tuple[float, float]  #: distances on the sheet for the sides of the rectangle [m]
    move_x: float  #: from the electrical centre to the place, in the rectangle [m]
    move_y: float
    dipole: _DipoleStrength
    edge: (
        float  #: what place and edges add to c of a disc: less 2 pi/Rs times the Robin function, less ln of the stretch
    )
    line: tuple[float, float] | None  #: of what is no disc: half length [m], direction from u towards phi [rad]

    def covariance(
        self, share: float, motion: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> tuple[float, float, float]:
        """Return the covariances uu, us, ss of a place that was worked out with this estimate [m^2].

        Args:
            share: variance of its centre over that of one frame.
            motion: covariances of the centre by motion, as ratios of the sides squared.
        """
        uu, us, ss = self.fixed
        one_uu, one_us, one_ss = self.one
        along, around = self.scale
        xx, xy, yy = motion
        return (
            uu + share * one_uu + xx * along * along,
            us + share * one_us + xy * along * around,
            ss + share * one_ss + yy * around * around,
        )

    def radius(self) -> tuple[float | None, float | None]:
        """Return the radius of the contact [m] and the deviation of its logarithm, where they can be told."""
        radius, deviation = self.dipole.log_radius, self.dipole.log_radius_deviation
        return (math.exp(radius), deviation) if deviation < 0.5 else (None, None)


class PlaceEstimator:
    """The places of the contacts on one sensor.

    Attributes:
        curvature: of the arc at end 1, signed [1/m]: the sheet is stretched by exp(curvature x).
        length: of the rectangle between the arcs [m].
        breadth: of the rectangle between the straight edges [m].
        sheets: conductances of the upper and the lower sheet that it takes them for [S].
    """

    def __init__(self, sensor: Sensor) -> None:
        cone = sensor.frustum
        self.curvature = cone.sin_half_angle / cone.radius1
        self.breadth = cone.radius1 * cone.wrap
        self.length = math.log1p(self.curvature * cone.slant) / self.curvature if self.curvature else cone.slant
        self._per_y = cone.wrap
        self._within = (
            *(_EDGE_MARGIN * self.length, (1.0 - _EDGE_MARGIN) * self.length),
            *(_EDGE_MARGIN * self.breadth, (1.0 - _EDGE_MARGIN) * self.breadth),
        )
        self.sheets = (0.0, 0.0)
        self._sum = 0.0
        parts = sensor.electronics
        count = parts.current_full_scale / parts.full_count / parts.supply_volts  # in siemens
        self._count = 0.5 * count * math.hypot(self.length**2, self.breadth**2)  # of both currents, as an inequality
        self._floor = PlaceFloor(
            sensor.tolerance, (self.length, self.breadth), (sensor.radial_ohms, sensor.angular_ohms)
        )
        self._robin = self._learn(
            self.breadth / (sensor.upper_sheet_ohms * self.length),
            self.length / (sensor.lower_sheet_ohms * self.breadth),
        )

    def _learn(self, upper: float, lower: float) -> RobinFunction:
        upper_ohms, lower_ohms = self.breadth / (upper * self.length), self.length / (lower * self.breadth)
        self.sheets, self._sum = (upper, lower), upper_ohms + lower_ohms
        self._robin = RobinFunction(self.length, self.breadth, upper_ohms, lower_ohms)
        return self._robin

    def estimate(
        self, matrix: ContactMatrix, one: MatrixNoise, frames: float, sheets: SheetConductances
    ) -> PlaceEstimate:
        """Return the place of a contact.

        Args:
            matrix: of one frame, or the mean over some.
            one: noise of one frame's matrix.
            frames: number of frames in the mean.
            sheets: without contact.
        """
        if not (
            0.998 < sheets.upper / self.sheets[0] < 1.002 and 0.998 < sheets.lower / self.sheets[1] < 1.002
        ):  # the edges' images depend on them, by less than this matters
            self._learn(sheets.upper, sheets.lower)
        length, breadth, rs = self.length, self.breadth, self._sum
        seen_x, seen_y = matrix.x * length, matrix.y * breadth
        squares = length * length, length * breadth, breadth * breadth
        a_xx, a_yy = (matrix.along - sheets.upper) * squares[0], (matrix.around - sheets.lower) * squares[2]
        a_xy = matrix.cross * squares[1]
        share = 1.0 / frames
        noise_xx = (share * one.along + sheets.upper_variance) * squares[0] * squares[0]
        noise_yy = (share * one.around + sheets.lower_variance) * squares[2] * squares[2]
        noise_both = share * one.along_around * squares[0] * squares[2]
        noise_xy = share * one.cross * squares[1] * squares[1]

        x, y = self._inside(seen_x, seen_y)
        stretch = math.exp(self.curvature * x)
        robin, slope_x, slope_y = self._robin.value_and_gradient(x, y)
        taper = rs * self.curvature / (4.0 * math.pi)
        one_xx, one_xy, one_yy = one.xx * squares[0], one.xy * squares[1], one.yy * squares[2]
        noise_place = share * (one_xx + one_yy)
        # the mean of both, each weighed by its noise: for a round contact they are equal
        weight = (noise_yy - noise_both) / max(noise_xx + noise_yy - 2.0 * noise_both, 1e-60)
        weight = 0.0 if weight < 0.0 else 1.0 if weight > 1.0 else weight
        rest = 1.0 - weight
        noise = weight * weight * noise_xx + rest * rest * noise_yy + 2.0 * weight * rest * noise_both
        measured = weight * a_xx + rest * a_yy
        unequal = 0.5 * (a_xx - a_yy)
        noise_unequal = 0.25 * (noise_xx + noise_yy - 2.0 * noise_both)
        tapered = 0.5 * slope_x + taper
        per_dipole = tapered * tapered + 0.25 * slope_y * slope_y  # square of the displacement by it
        tolerated = noise_place / (per_dipole + 1e-12 * rs * rs)
        dipole = _weigh_dipole(measured, noise, rs, 1.0 / matrix.conductance - robin, stretch, tolerated)
        edge_c = -2.0 * math.pi / rs * robin - math.log(stretch)
        prior = _ROUND_INEQUALITY * _ROUND_INEQUALITY * dipole.strength * dipole.strength
        gain1, gain2 = _gain(unequal, noise_unequal, prior), _gain(a_xy, noise_xy, prior)
        half, cross = gain1 * unequal, gain2 * a_xy
        # where the inequality is real, the weighed mean must not count it twice
        mean = dipole.strength - (2.0 * weight - 1.0) * half
        a_xx, a_yy, a_xy = mean + half, mean - half, cross

        unlike, reach, line = math.hypot(half, cross), 0.0, None
        sure = unlike - self._count  # a converter is not straight to more than a count
        if sure > _LONG_INEQUALITY * mean and sure * sure > _REAL_VARIANCE * (noise_unequal + noise_xy):
            reach = _half_length(2.0 * unlike, 1.0 / matrix.conductance - robin, rs / (2.0 * math.pi))
            line = stretch * reach, 0.5 * math.atan2(cross, half)

        move_x = move_y = size = 0.0
        for again in (False, True):
            if again:
                if size * size < noise_place:
                    break  # it changes by less than noise does
                _, slope_x, slope_y = self._robin.value_and_gradient(x, y)
            move_x = 0.5 * (a_xx * slope_x + a_xy * slope_y) + taper * (2.0 * a_xx - a_yy)
            move_y = 0.5 * (a_xy * slope_x + a_yy * slope_y) + 3.0 * taper * a_xy
            most = _MAX_STEP * (length + breadth)
            size = math.hypot(move_x, move_y)
            if size > most:
                move_x, move_y = move_x * most / size, move_y * most / size
            x, y = self._inside(seen_x + move_x, seen_y + move_y)

        # derivatives of the place by mean, inequality and cross; what was shrunk counts by its gain
        by_mean_x, by_mean_y = 0.5 * slope_x + taper, 0.5 * slope_y
        by_half_x, by_half_y = rest * slope_x + (4.0 - 2.0 * weight) * taper, -weight * slope_y
        by_cross_x, by_cross_y = 0.5 * slope_y, 0.5 * slope_x + 3.0 * taper
        var_mean, gain = dipole.variance, dipole.gain
        var_half, var_cross = gain1 * noise_unequal, gain2 * noise_xy
        x_mean = (weight * one.x_along * squares[0] + rest * one.x_around * squares[2]) * length
        y_mean = (weight * one.y_along * squares[0] + rest * one.y_around * squares[2]) * breadth
        x_mean, y_mean = gain * share * x_mean, gain * share * y_mean
        area = abs(dipole.strength) * rs / (2.0 * math.pi)
        edge, moved = min(min(x, length - x), min(y, breadth - y)), math.hypot(move_x, move_y)
        curved = _NEXT_TAPER * math.sqrt(area) * self.curvature * self.curvature
        neglected = area * (_NEXT_IMAGE * moved / (edge * edge) + curved)
        neglected *= neglected
        xx, xy, yy = self._floor.at(x / length, y / breadth, move_x, move_y)
        xx += by_mean_x * by_mean_x * var_mean + by_half_x * by_half_x * var_half + by_cross_x * by_cross_x * var_cross
        xx += 2.0 * by_mean_x * x_mean + neglected
        yy += by_mean_y * by_mean_y * var_mean + by_half_y * by_half_y * var_half + by_cross_y * by_cross_y * var_cross
        yy += 2.0 * by_mean_y * y_mean + neglected
        xy += by_mean_x * by_mean_y * var_mean + by_half_x * by_half_y * var_half
        xy += by_cross_x * by_cross_y * var_cross + by_mean_y * x_mean + by_mean_x * y_mean
        if line:
            square = reach * reach
            along, across = _UNEVEN_ALONG * _UNEVEN_ALONG * square, _UNEVEN_ACROSS * _UNEVEN_ACROSS * square
            both, differ = 0.5 * (along + across), 0.5 * (along - across) / unlike
            xx, xy, yy = xx + both + differ * half, xy + differ * cross, yy + both - differ * half
        stretch = math.exp(self.curvature * x)
        squared = stretch * stretch
        u, phi = self.place(matrix.x, matrix.y, move_x, move_y)
        values = (
            u,
            phi,
            (squared * xx, squared * xy, squared * yy),
            (squared * one_xx, squared * one_xy, squared * one_yy),
            (stretch * length, stretch * breadth),
            move_x,
            move_y,
            dipole,
            edge_c,
            line,
        )
        return tuple.__new__(PlaceEstimate, values)

    def disc_dipole(self, radius: float, conductance: float, edge: float) -> float:
        """Return the dipole of one disc of a radius [m] that has a conductance [S], on the sheet [S m^2].

        No disc of that conductance within the radius has more: what is narrower must be firmer, and adds less.
        """
        k = 2.0 * math.pi / self._sum
        return k * radius * radius * _disc_share(max(_MIN_DISC_C, math.log(radius) + k / conductance + edge))

    def place(self, x: float, y: float, move_x: float, move_y: float) -> tuple[float, float]:
        """Return u [m] and phi [rad] of an electrical centre and the move from there to the place [m]."""
        curvature, breadth = self.curvature, self.breadth
        low_x, high_x, low_y, high_y = self._within
        along, around = x * self.length + move_x, y * breadth + move_y
        if not (low_x < along < high_x and low_y < around < high_y):
            along, around = self._inside(along, around)
        return math.expm1(curvature * along) / curvature if curvature else along, around / breadth * self._per_y

    def _inside(self, x: float, y: float) -> tuple[float, float]:
        low_x, high_x, low_y, high_y = self._within
        return (
            low_x if x < low_x else high_x if x > high_x else x,
            low_y if y < low_y else high_y if y > high_y else y,
        )


def _half_length(dipole: float, beyond: float, ohms: float) -> float:
    """Return half the distance of two equal contacts that add a dipole: s^2 = A (1/G - gamma + (Rs/2 pi) ln 2s) [m].

    Args:
        dipole: A, along their line less across [S m^2].
        beyond: 1/G - gamma, distances in metres [ohm]. What one adds to the other's potential is taken off 1/G.
        ohms: Rs/(2 pi).
    """
    least = 0.5 * dipole * ohms  # of s^2; it has a bond without a gap
    square = dipole * max(beyond, ohms)
    for _ in range(_LONG_STEPS):
        square = max(least, dipole * (beyond + 0.5 * ohms * math.log(4.0 * square)))
    return math.sqrt(square)


def _gain(seen: float, noise: float, prior: float) -> float:
    """Return how much of an inequality to believe: little of what a round contact has not, all of what stands out."""
    beyond = seen * seen - _REAL_VARIANCE * noise
    prior += beyond if beyond > 0.0 else 0.0
    return prior / (prior + noise) if prior + noise > 0.0 else 0.0
