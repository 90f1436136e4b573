"""Disc solver once more, in 60 digits and by other formulas: theta functions as products, no mirroring, no expm1.

Same order M and same N points on the circle as the solver, so that the difference is rounding alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import mpmath as mp

from coneskin.skin.field.circles import PHASE
from coneskin.skin.field.sheet import SectorSheet

DIGITS = 60


@dataclass(frozen=True, slots=True)
class ExactSolution:
    """A solution in mpmath numbers.

    Attributes:
        volts: potentials of the guides C, D in the radial phase and A, B in the angular one, at 1 V of drive [V].
        conductance: of the contact with its spreading resistance [S].
        xx: polarisability of the contact along x [S].
        yy: polarisability of the contact along y [S].
        centre: place of the contact (x, y) in parts of the sheet.
        condition: of the scaled system, in the 1-norm.
    """

    volts: tuple[mp.mpf, ...]
    conductance: mp.mpf
    xx: mp.mpf
    yy: mp.mpf
    centre: tuple[mp.mpf, mp.mpf]
    condition: mp.mpf


def _theta(z: mp.mpc, sigma: mp.mpf) -> mp.mpc:
    out = 2 * mp.sinh(z / 2)
    n = 1
    while 2 * n * sigma - abs(mp.re(z)) < 2.4 * DIGITS:
        out *= (1 - mp.exp(z - 2 * n * sigma)) * (1 - mp.exp(-z - 2 * n * sigma))
        n += 1
    return out


def solve_exactly(
    sheet: SectorSheet,
    upper: float,
    lower: float,
    u: float,
    phi: float,
    radius: float,
    g: float,
    order: int,
    points: int,
) -> ExactSolution:
    """Solve one disc; arguments as for the solver, taken as exact binary numbers."""
    with mp.workdps(DIGITS):
        kappa, width, arc = mp.mpf(sheet.curvature), mp.mpf(sheet.width), mp.mpf(sheet.arc)
        ru, rl, u_, a = mp.mpf(upper), mp.mpf(lower), mp.mpf(u), mp.mpf(radius)

        def along(d: mp.mpf) -> mp.mpf:
            return mp.log(1 + kappa * d) / kappa if kappa else d

        length, breadth = along(width), arc
        stretch = 1 + kappa * u_
        xc, yc = along(u_), arc * mp.mpf(phi) / mp.mpf(sheet.wrap)
        along_x = breadth <= length
        scale = mp.pi / min(length, breadth)
        sigma = scale * max(length, breadth)
        ra, rb = (rl, ru) if along_x else (ru, rl)
        rs = ru + rl
        phase = mp.mpf(PHASE)
        zeta = [mp.expjpi(2 * (j + phase) / points) for j in range(points)]
        w = [mp.log(1 + kappa * a * z / stretch) / kappa if kappa else a * z / stretch for z in zeta]
        full = [mp.mpc(xc + mp.re(v), yc + mp.im(v)) for v in w]
        omega = [scale * (v if along_x else mp.mpc(mp.im(v), mp.re(v))) for v in full]
        slope = [scale * a / abs(stretch + kappa * a * z) for z in zeta]
        at_zero = mp.mpf(1)
        n = 1
        while 2 * n * sigma < 2.4 * DIGITS:
            at_zero *= (1 - mp.exp(-2 * n * sigma)) ** 2
            n += 1
        images = [] if ra == rb else _images(kappa, width, arc, u_, a, phi, sheet.wrap)
        green = mp.matrix(points, points)
        for i in range(points):
            for j in range(i + 1):
                p, q = omega[i], omega[j]
                direct = at_zero * slope[i] if i == j else abs(_theta(p - q, sigma) / (zeta[i] - zeta[j]))
                value = rs * (mp.log(direct) - mp.log(abs(_theta(p + q, sigma))))
                if ra != rb:
                    end, edge = abs(_theta(p + mp.conj(q), sigma)), abs(_theta(p - mp.conj(q), sigma))
                    value += (ra - rb) * (mp.log(end) - mp.log(edge))
                value = -value / (2 * mp.pi) - rb * mp.re(p) * mp.re(q) / (mp.pi * sigma)
                for arc_edge, alpha, gamma in images:
                    z, y = zeta[i], mp.conj(zeta[j])
                    distance = abs(1 + alpha * z + mp.conj(alpha) * y + gamma * z * y)
                    value -= (1 if arc_edge else -1) * (ru - rl) / (2 * mp.pi) * mp.log(distance)
                green[i, j] = green[j, i] = value
        size = 2 * order + 1
        fourier = mp.matrix(size, points)
        for j in range(points):
            fourier[0, j] = mp.mpf(1) / points
            for m in range(1, order + 1):
                fourier[2 * m - 1, j] = mp.re(zeta[j] ** m) * 2 / points
                fourier[2 * m, j] = mp.im(zeta[j] ** m) * 2 / points
        k = fourier * green * fourier.T
        for arc_edge, alpha, gamma in images:
            k += (1 if arc_edge else -1) * (ru - rl) / (2 * mp.pi) * _coefficients(alpha, gamma, order)
        fx, fy = mp.matrix(size, 1), mp.matrix(size, 1)
        fx[0], fy[0] = xc / length, yc / breadth
        for m in range(1, order + 1):
            c = (a / stretch) * (-kappa * a / stretch) ** (m - 1) / m
            fx[2 * m - 1], fy[2 * m] = c / length, c / breadth
        ka = a * mp.sqrt(mp.mpf(g) * rs) if g != mp.inf and g != float("inf") else mp.inf
        d0, inverse = _disc(ka, rs, order)
        root = mp.matrix(size, 1)
        for m in range(1, order + 1):
            root[2 * m - 1] = root[2 * m] = mp.sqrt(inverse[m - 1])
        inner = mp.matrix(size - 1, size - 1)
        right = mp.matrix(size - 1, 3)
        for i in range(1, size):
            for j in range(1, size):
                inner[i - 1, j - 1] = root[i] * k[i, j] * root[j] + (1 if i == j else 0)
            right[i - 1, 0], right[i - 1, 1], right[i - 1, 2] = root[i] * k[i, 0], root[i] * fx[i], root[i] * fy[i]
        solved = mp.inverse(inner) * right
        gram = right.T * solved
        x, y = fx[0] - gram[0, 1], fy[0] - gram[0, 2]
        conductance = 1 / (d0 + k[0, 0] - gram[0, 0]) if d0 != mp.inf else mp.mpf(0)
        sheet_u, sheet_l = breadth / (ru * length), length / (rl * breadth)
        xx, xy, yy = gram[1, 1], gram[1, 2], gram[2, 2]
        apart1, apart2 = -xy / (sheet_l + yy), xy / (sheet_u + xx)
        v_d = 1 - x - apart1 * y
        v_b = y - apart2 * x
        volts = (v_d + apart1, v_d, v_b + apart2, v_b)
        norm = [mp.mnorm(inner, 1), mp.mnorm(mp.inverse(inner), 1)]
        return ExactSolution(
            volts=volts, conductance=conductance, xx=xx, yy=yy, centre=(fx[0], fy[0]), condition=norm[0] * norm[1]
        )


def _images(
    kappa: mp.mpf, width: mp.mpf, arc: mp.mpf, u: mp.mpf, a: mp.mpf, phi: float, wrap: float
) -> list[tuple[bool, mp.mpc, mp.mpf]]:
    """Return (arc or straight, alpha, gamma) of the near edges, from their definitions."""
    h, last = 1 + kappa * u, 1 + kappa * width
    out = []
    for edge, flat_gap in ((mp.mpf(1), u), (last, u - width)):
        # h^2 (1 + q z)(1 + q z*) - edge^2 over (h^2 - edge^2)
        gap = (h * h - edge * edge) / kappa if kappa else 2 * flat_gap
        alpha = h * a / gap
        out.append((True, mp.mpc(alpha), alpha * kappa * a / h))
    y = arc * mp.mpf(phi) / mp.mpf(wrap)
    for sign, rest in ((-1, y), (1, arc - y)):
        turn = kappa * rest
        distance = h * (mp.sin(turn) / kappa if kappa else rest)
        if abs(turn) < mp.pi / 2:
            out.append((False, sign * mp.mpc(0, 1) * a / (2 * distance) * mp.expj(-sign * turn), mp.mpf(0)))
    return [image for image in out if abs(image[1]) > mp.mpf("0.25")]


def _coefficients(alpha: mp.mpc, gamma: mp.mpf, order: int) -> mp.matrix:
    """Return the Fourier coefficients of ln|1 + alpha z + alpha* z'* + gamma z z'*| on the circles."""
    conj, delta = mp.conj(alpha), abs(alpha) ** 2 - gamma
    out = mp.matrix(2 * order + 1, 2 * order + 1)
    for m in range(order + 1):
        for n in range(order + 1):
            if m == n == 0:
                continue
            if n == 0:
                value = -((-alpha) ** m) / m
            elif m == 0:
                value = -((-conj) ** n) / n
            else:
                value = -sum(
                    delta**k
                    / k
                    * mp.binomial(m - 1, k - 1)
                    * mp.binomial(n - 1, k - 1)
                    * (-alpha) ** (m - k)
                    * (-conj) ** (n - k)
                    for k in range(1, min(m, n) + 1)
                )
            real, imag = mp.re(value), mp.im(value)
            c = [0 if i == 0 else 2 * i - 1 for i in (m, n)]
            out[c[0], c[1]] = real
            if n:
                out[c[0], 2 * n] = imag
            if m:
                out[2 * m, c[1]] = -imag
            if m and n:
                out[2 * m, 2 * n] = real
    return out


def _disc(ka: mp.mpf, rs: mp.mpf, order: int) -> tuple[mp.mpf, list[mp.mpf]]:
    """Return D_0, and 1/D_m."""
    if ka == mp.inf:
        return mp.mpf(0), [2 * mp.pi * m / rs for m in range(1, order + 1)]
    if ka == 0:
        return mp.inf, [mp.mpf(0)] * order
    if ka > 1e4:  # downward from far above by the continued fraction would not end: Hankel's series instead
        bessel = [_hankel(m, ka) for m in range(order + 2)]
    else:
        bessel = [mp.besseli(m, ka) for m in range(order + 2)]
    d0 = rs / (2 * mp.pi) * bessel[0] / (ka * bessel[1])
    return d0, [2 * mp.pi * m / rs * bessel[m + 1] / bessel[m - 1] for m in range(1, order + 1)]


def _hankel(order: int, x: mp.mpf) -> mp.mpf:
    total = term = mp.mpf(1)
    for j in range(1, 40):
        term *= -(4 * mp.mpf(order) ** 2 - (2 * j - 1) ** 2) / (j * 8 * x)
        total += term
    return total
