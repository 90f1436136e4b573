"""Strength of a contact's dipole, and its radius: what was measured, weighed against what a round contact can have.

A round contact of radius a and conductance g per area has, in the rectangle of the field,

    A = (2 pi/Rs) a^2 I_2(ka)/I_0(ka),      1/G = Rs/(2 pi) (c - ln a) + (Robin function),   c = I_0(ka)/(ka I_1(ka))

with k^2 = g Rs. G is measured well, A badly where the converter is coarse. So G leaves one line of pairs (a, g), a
usual radius weighs them, and the measured A weighs them again: A with its variance follows, and ln a. A weak contact
thus has hardly any dipole, whatever its noise says, and a bonded one that of its G.
"""

from __future__ import annotations

import math
from typing import NamedTuple

__all__ = ["DipoleStrength", "weigh_dipole"]

_USUAL_RADIUS = math.log(0.005)  # ln m; radius of a usual contact, a fingertip's
_WEIGHT_RADIUS = 1.0  # of ln a: one over its variance
_MIN_RADIUS, _MAX_RADIUS = math.log(0.0005), math.log(0.03)  # ln m
_WEIGHT_KA = 0.25 / 1.5**2  # of ln (ka)^2: a quarter over the variance of ln ka about 1
_MAX_KA_WEIGHT = 6.0  # a bond has an infinite ka, and is no less usual than this says
_LAST_NODE = 6
_NODE_NUMBERS = range(_LAST_NODE + 1)
_MIN_C = 0.003  # ka of 300: a bond
_NODE_WIDTH = 0.35  # of the distance between a node's neighbours
_MODEL_VARIANCE = 0.05**2  # of A^2; no real contact is a uniform disc
_MODEL_RADIUS = 0.1  # of ln a; half the distance of two nodes, and the same


class DipoleStrength(NamedTuple):
    """A dipole and the contact that it belongs to."""

    strength: float  #: A, mean of the polarisability along and around, as it is corrected for [S m^2]
    variance: float  #: mean square of the distance from that [S^2 m^4]
    gain: float  #: how far it follows what was measured, 0..1
    log_radius: float  #: mean of ln a, a in m
    log_radius_deviation: float  #: standard deviation of ln a


def weigh_dipole(
    measured: float, variance: float, resistance: float, beyond: float, stretch: float, tolerated: float
) -> DipoleStrength:
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
    z = math.sqrt(low)
    step = (math.sqrt(high) - z) / _LAST_NODE
    # exp(2 c) from node to node, c = z^2: its ratios grow by a constant ratio
    power, ratio = k / (stretch * stretch) * math.exp(2.0 * (low - shift)), math.exp(2.0 * step * (2.0 * z + step))
    growth = math.exp(4.0 * step * step)
    nodes = []
    for _ in _NODE_NUMBERS:
        c = z * z
        twice = 1.0 + c + c
        off, ka = c - shift - _USUAL_RADIUS, math.log(twice / (c * c))
        ka *= _WEIGHT_KA * ka
        # 1/f = I_0/I_2 to .4 %, exact at both ends; the last is d ln a/dz, but for a factor
        nodes.append(
            (
                power / (1 / 3 + 4.0 * c + 2 / 3 / (1.0 + c * (3.0 + 7.0 * c))),
                c - shift,
                _WEIGHT_RADIUS * off * off + (ka if ka < _MAX_KA_WEIGHT else _MAX_KA_WEIGHT),
                z,
            )
        )
        power *= ratio
        ratio *= growth
        z += step
    return _posterior(measured, variance, tolerated, nodes)


def _posterior(
    measured: float, variance: float, tolerated: float, nodes: list[tuple[float, float, float, float]]
) -> DipoleStrength:
    """Weigh the measurement against a mixture of normal distributions about the nodes, as wide as these are apart."""
    before, found, best = nodes[0][0], [], math.inf
    for (strength, log_radius, unlikely, density), after in zip(nodes, [*nodes[1:], nodes[-1]], strict=True):
        gap = _NODE_WIDTH * (after[0] - before)
        width = gap * gap + _MODEL_VARIANCE * strength * strength
        off, gain = measured - strength, 1.0 / (width + variance)
        unlikely += off * off * gain
        if unlikely < best:
            best = unlikely
        mean = strength + width * gain * off
        found.append((unlikely, density * math.sqrt(gain), mean, width * gain * variance + mean * mean, log_radius))
        before = strength
    whole = first = second = logs = log_squares = part = parts = 0.0
    for unlikely, density, mean, square, log_radius in found:
        weight = density * math.exp(0.5 * (best - unlikely))
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
    return DipoleStrength(
        strength,
        spread + (mean - strength) ** 2,
        min(1.0, spread / variance) if variance > 0.0 else 1.0,
        log_radius,
        math.sqrt(max(0.0, log_squares * share - log_radius * log_radius) + _MODEL_RADIUS * _MODEL_RADIUS),
    )
