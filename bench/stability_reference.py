"""The disc solver again, in 60 digits and by other formulas: theta functions as products, nothing mirrored, no expm1.

Same order M and same N points on the circle as the solver, so that the difference is rounding alone.
"""

from __future__ import annotations

import mpmath as mp

from coneskin.skin.field_sheet import SectorSheet

__all__ = ["Exact", "solve"]

DIGITS = 60


class Exact:
    """Potentials of the ideal phases and the coupling, as mpmath numbers; condition of the scaled system."""

    def __init__(self, **values: object) -> None:
        self.__dict__.update(values)


def _theta(z: mp.mpc, sigma: mp.mpf) -> mp.mpc:
    out = 2 * mp.sinh(z / 2)
    n = 1
    while 2 * n * sigma - abs(mp.re(z)) < 2.4 * DIGITS:
        out *= (1 - mp.exp(z - 2 * n * sigma)) * (1 - mp.exp(-z - 2 * n * sigma))
        n += 1
    return out


def solve(
    sheet: SectorSheet,
    upper: float,
    lower: float,
    u: float,
    phi: float,
    radius: float,
    g: float,
    order: int,
    points: int,
) -> Exact:
    """One disc; arguments as for the solver, taken as exact binary numbers."""
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
        zeta = [mp.expjpi(mp.mpf(2 * j) / points) for j in range(points)]
        w = [mp.log(1 + kappa * a * z / stretch) / kappa if kappa else a * z / stretch for z in zeta]
        full = [mp.mpc(xc + mp.re(v), yc + mp.im(v)) for v in w]
        omega = [scale * (v if along_x else mp.mpc(mp.im(v), mp.re(v))) for v in full]
        slope = [scale * a / abs(stretch + kappa * a * z) for z in zeta]
        at_zero = mp.mpf(1)
        n = 1
        while 2 * n * sigma < 2.4 * DIGITS:
            at_zero *= (1 - mp.exp(-2 * n * sigma)) ** 2
            n += 1
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
                green[i, j] = green[j, i] = value
        size = 2 * order + 1
        fourier = mp.matrix(size, points)
        for j in range(points):
            fourier[0, j] = mp.mpf(1) / points
            for m in range(1, order + 1):
                fourier[2 * m - 1, j] = mp.re(zeta[(m * j) % points]) * 2 / points
                fourier[2 * m, j] = mp.im(zeta[(m * j) % points]) * 2 / points
        k = fourier * green * fourier.T
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
        return Exact(
            volts=volts, conductance=conductance, xx=xx, yy=yy, centre=(fx[0], fy[0]), condition=norm[0] * norm[1]
        )


def _disc(ka: mp.mpf, rs: mp.mpf, order: int) -> tuple[mp.mpf, list[mp.mpf]]:
    """D_0, and 1/D_m."""
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
