"""Maps of potential and current density on the two sheets, and of the error of the decoded place.

Each sheet's potential is the straight one between its electrodes plus what the multipoles of the contacts add.
Outside a disc their logarithmic part is a sum over moments, inside it follows the difference d = sum c_m I_m(k
rho); the images act from points on the circle. So the result is as exact as the solver, up to the rim and across
it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from coneskin.core.arrays import Complex, Floats
from coneskin.core.errors import FieldError

from .circles import Centres, Circles, circle, make_circles, pair_points
from .disc import Disc, Discs, bessel_ratios, check_discs
from .fourport import DrivePhase, angular_phase, radial_phase
from .green import Strip, kernel
from .model import FieldModel
from .multipole import resolution, solve_to_tolerance


@dataclass(frozen=True, slots=True, eq=False)
class FieldMap:
    """The solved field of one scene in one phase."""

    model: FieldModel
    discs: tuple[Disc, ...]  #: the contacts; may be none, if the phase fixes both sheets without them
    electrodes: tuple[float, float, float, float]  #: potentials of A, B, C, D [V]
    moments: Floats  #: of the current of each disc [A], shape (k, 2M+1)

    @classmethod
    def of(cls, model: FieldModel, discs: Sequence[Disc], phase: DrivePhase) -> FieldMap:
        """Solve one scene in one phase.

        Raises:
            FieldError: a contact that cannot be, a tolerance that multipoles cannot meet, or a sheet that floats.
        """
        sheet = model.sheet
        if discs:
            scene = Discs.of(discs)
            check_discs(sheet, scene)
            # The readings are stationary in the moments, the potentials are not.
            tolerance = max(1e-3 * model.tolerance, 1e-15)
            order = int(resolution(sheet, scene, model.contrast, tolerance)[0])
            ohms = model.upper_resistance, model.lower_resistance
            coupling, moments = solve_to_tolerance(sheet, *ohms, scene, order, tolerance)
        else:
            ghost = Disc(0.5 * sheet.width, 0.5 * sheet.wrap, 1e-3 * min(sheet.width, sheet.arc), 0.0)
            coupling, moments = model.discs([ghost]), np.zeros((1, 0, 3, 3))
        a, b, c, d = (float(v) for v in model.read(coupling, phase).electrodes[0])
        return cls(model, tuple(discs), (a, b, c, d), moments[0] @ np.array([b - d, a - b, d - c]))

    def potentials(self, u: ArrayLike, phi: ArrayLike) -> tuple[Floats, Floats]:
        """Return the potentials of the upper and of the lower sheet at (u, phi) [V]; arguments broadcast.

        Raises:
            FieldError: a point off the sheet, or a sheet more than 200 times longer than wide.
        """
        u, phi = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(phi, dtype=np.float64))
        model, sheet = self.model, self.model.sheet
        if not ((u >= 0.0) & (u <= sheet.width) & (phi >= 0.0) & (phi <= sheet.wrap)).all():
            raise FieldError(
                f"points must lie on the sheet: u in [0, {sheet.width:.6g}] m, phi in [0, {sheet.wrap:.6g}] rad"
            )
        x = sheet.along(u)[0] / sheet.length
        y = sheet.across(phi)[0] / sheet.breadth
        a, b, c, d = self.electrodes
        upper, lower = b + (a - b) * x, d + (c - d) * y
        for disc, moments in zip(self.discs, self.moments, strict=True):
            by_upper, by_lower = self._added(disc, moments, u.ravel(), phi.ravel())
            upper = upper - model.upper_resistance * by_upper.reshape(u.shape)
            lower = lower + model.lower_resistance * by_lower.reshape(u.shape)
        return upper, lower

    def currents(self, u: ArrayLike, phi: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
        """Return current densities (upper e_u, upper e_phi, lower e_u, lower e_phi) [A/m].

        Central differences of the potentials over 1e-5 of the shorter side, 1e-9 from exact away from a rim.
        """
        sheet, model = self.model.sheet, self.model
        u, phi = np.broadcast_arrays(np.asarray(u, dtype=np.float64), np.asarray(phi, dtype=np.float64))
        h = 1e-5 * min(sheet.length, sheet.breadth)
        edge = 1.000001 * h  # so that no rounding takes a point off the sheet
        x = np.clip(sheet.along(u)[0], edge, sheet.length - edge)
        y = np.clip(sheet.across(phi)[0], edge, sheet.breadth - edge)
        east, west = self.potentials(*sheet.locate(x + h, y)), self.potentials(*sheet.locate(x - h, y))
        north, south = self.potentials(*sheet.locate(x, y + h)), self.potentials(*sheet.locate(x, y - h))
        out = []
        for i, resistance in enumerate((model.upper_resistance, model.lower_resistance)):
            per = -1.0 / (2.0 * h * resistance * sheet.stretch(u))
            out += [per * (east[i] - west[i]), per * (north[i] - south[i])]
        return out[0], out[1], out[2], out[3]

    def _added(self, disc: Disc, moments: Floats, u: Floats, phi: Floats) -> tuple[Floats, Floats]:
        """Integrate G_u j and G_l j of one disc at points, per ohm [A]."""
        sheet = self.model.sheet
        strip = Strip.of(sheet.length, sheet.breadth)
        if strip.sigma > 200.0 * math.pi:
            ratio = strip.sigma / math.pi
            raise FieldError(f"a map needs a sheet at most 200 times longer than wide, got {ratio:.0f} times")
        # Each sheet alone has images in the edges, also where those of equal sheets cancel in the solver.
        room = float(sheet.edge_distances(disc.u, disc.phi).min()) / disc.radius
        order = moments.size // 2
        n = max(4 * order + 2, min(int(38.0 / math.acosh(max(room, 1.0005))), 1200))
        zeta, _, fourier = circle(order, n)
        source = make_circles(sheet, strip, Discs.of([disc]), order, n)
        charges = fourier.T @ moments
        flat = sheet.flat(u, phi, (disc.u, disc.phi)) / disc.radius
        by_a, by_b = np.empty(u.size), np.empty(u.size)
        for start in range(0, u.size, 1024):
            part = slice(start, start + 1024)
            by_a[part], by_b[part] = self._images(strip, source, flat[part], zeta, charges, u[part], phi[part])
        log = self._logarithm(disc, moments, flat)
        by_a += log
        by_b += log
        return (by_b, by_a) if strip.along_x else (by_a, by_b)

    def _images(
        self, strip: Strip, source: Circles, flat: Complex, zeta: Complex, charges: Floats, u: Floats, phi: Floats
    ) -> tuple[Floats, Floats]:
        """Sum both Green functions without -ln|z - z'| / 2 pi over the charges on the circle, at points."""
        sheet = self.model.sheet
        place = sheet.along(u)[0] + 1j * sheet.across(phi)[0]
        s, p = source.centres.s[0, 0], source.centres.p[0, 0]
        offset = strip.scale * place - (s + 1j * p if strip.along_x else p + 1j * s)
        both = Centres(*(np.repeat(distance, 2, axis=1) for distance in source.centres))
        field, points, weight, _, centre = pair_points(strip, both, (offset[None], source.offset[:, 0]), 0, 1, False)
        squared = np.abs(flat[:, None] - zeta[None, :]) ** 2
        floor = 1e-24  # of a point upon a node, where both distances vanish together
        out = []
        for a, b in ((1.0, 0.0), (0.0, 1.0)):
            values = kernel(strip, field, points, a, b, np.maximum(squared, floor), None)[0]
            if b:
                here, there = field.s[0][:, None], points.s[0][None, :]
                values = values + (weight * (here + there) - here * there / strip.sigma + centre) / math.pi
            out.append(values @ charges)
        return out[0], out[1]

    def _logarithm(self, disc: Disc, moments: Floats, flat: Complex) -> Floats:
        """Integrate -(1/2 pi) ln(|z - z'|/a) j at flat offsets in units of the radius."""
        from scipy import special

        rho, angle = np.abs(flat), np.angle(flat)
        rs = self.model.upper_resistance + self.model.lower_resistance
        ka = disc.radius * math.sqrt(rs * disc.conductance)
        inside = rho < 1.0
        out = np.where(inside, 0.0, -moments[0] * np.log(np.maximum(rho, 1.0)) / (2.0 * math.pi))
        order = moments.size // 2
        ratios = bessel_ratios(np.array(ka), order + 1)
        bonded = math.isinf(ka)
        far = np.minimum(1.0 / np.maximum(rho, 1e-300), 1e300)
        for m in range(order + 1):
            wave = moments[0] if m == 0 else moments[2 * m - 1] * np.cos(m * angle) + moments[2 * m] * np.sin(m * angle)
            if m > 0:
                out = out + wave / (2.0 * math.pi * m) * np.where(inside, rho**m, np.where(inside, 1.0, far) ** m)
            if bonded or ka == 0.0:
                continue  # d = 0 inside, or nothing flows
            # d on the rim over its moment: D_m less the logarithm's own share; times (shape inside - rho^m)
            rim = 1.0 / (math.pi * ka * ratios[m]) if m else 1.0 / (2.0 * math.pi * ka * ratios[0])
            z = np.where(inside, rho, 1.0) * ka
            shape = special.ive(m, z) / special.ive(m, ka) * np.exp(z - ka)
            out = out - np.where(inside, rim * wave * (shape - np.where(inside, rho, 1.0) ** m), 0.0)
        return np.asarray(out)


@dataclass(frozen=True, slots=True, eq=False)
class ErrorMap:
    """Errors of the decoded place over a grid of round contacts; NaN where the disc would not fit."""

    u: Floats  #: slant distances of the contacts [m], shape (n,)
    phi: Floats  #: azimuths of the contacts [rad], shape (m,)
    u_error: Floats  #: decoded minus true slant distance [m], shape (n, m)
    phi_error: Floats  #: decoded minus true azimuth [rad], shape (n, m)

    @classmethod
    def of(cls, model: FieldModel, radius: float, u: Floats, phi: Floats, conductance: float = math.inf) -> ErrorMap:
        """Compute the errors over a grid of discs of a radius [m]; conductance per area [S/m^2]."""
        at_u, at_phi = (values.ravel() for values in np.meshgrid(u, phi, indexing="ij"))
        fits = model.sheet.edge_distances(at_u, at_phi).min(axis=1) >= radius * (1.0 - 1e-13)
        out = np.full((2, at_u.size), math.nan)
        if fits.any():
            out[:, fits] = decode_errors(model, at_u[fits], at_phi[fits], radius, conductance)
        return cls(u, phi, *out.reshape(2, u.size, phi.size))


def decode_errors(
    model: FieldModel, u: Floats, phi: Floats, radius: ArrayLike, conductance: ArrayLike = math.inf
) -> tuple[Floats, Floats]:
    """Return decoded minus true (u [m], phi [rad]) by the paper's equations 20 and 24 from each guide pair's mean.

    Args:
        u: slant distance of the centres from end 1 [m].
        phi: azimuth of the centres [rad].
        radius: of the discs [m].
        conductance: per area [S/m^2]; inf is a perfect bond.
    """
    sheet = model.sheet
    coupling = model.contacts(u, phi, radius, conductance)
    radial = model.read(coupling, radial_phase()).terminals[:, 2:].mean(axis=1)
    angular = model.read(coupling, angular_phase()).terminals[:, :2].mean(axis=1)
    seen_u, seen_phi = sheet.locate((1.0 - radial) * sheet.length, angular * sheet.breadth)
    return seen_u - u, seen_phi - phi
