"""Contacts that grow and shrink while their middles stay: all that depends on the places is computed once.

Around a fixed middle everything outside a disc is harmonic, so its m-th Fourier coefficient goes with radius^m,
exactly. The coupling K of `multipole` for any radii up to the largest is therefore one matrix, scaled; only the
discs' own answer D changes with force. What is left for each moment is one small system: no interpolation, for any
number of contacts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from coneskin.core.arrays import Floats
from coneskin.core.errors import FieldError

from .circles import green_block, make_circles
from .disc import Discs, bessel_ratios, check_discs
from .fourport import Coupling
from .green import Strip
from .model import FieldModel
from .multipole import resolution, solve_to_tolerance

__all__ = ["FixedDiscs"]


@dataclass(frozen=True, slots=True, eq=False)
class FixedDiscs:
    """The places of k contacts on a sheet, and all that does not depend on how firmly they are pressed.

    Attributes:
        model: the sheet and its resistances.
        largest: radius up to which each contact may grow [m], shape (k,).
        order: multipole order M that the model's tolerance needs at these radii and a perfect bond.
        block: K between the places at their largest radii, in units of Ru + Rl, shape (k, 2M+1, k, 2M+1).
        right: f for h0, hx and hy, shape (k, 2M+1, 3).
        error: estimate of the error at these radii, relative to the supply; smaller contacts have a smaller one.
    """

    model: FieldModel
    largest: Floats
    order: int
    block: Floats
    right: Floats
    error: float

    @classmethod
    def of(cls, model: FieldModel, u: ArrayLike, phi: ArrayLike, largest: ArrayLike) -> FixedDiscs:
        """Prepare the places.

        Args:
            model: the sheet and its resistances.
            u: slant distance of the middles from end 1 [m], shape (k,).
            phi: their azimuth [rad], shape (k,).
            largest: radius up to which each contact may grow [m], shape (k,).

        Raises:
            FieldError: a disc of the largest radius cuts an edge or overlaps another, or the tolerance cannot be met.
        """
        us, phis, radii = (np.array([v], dtype=np.float64) for v in np.broadcast_arrays(u, phi, largest))
        discs = Discs(us, phis, radii, np.full_like(radii, math.inf))
        sheet, upper, lower = model.sheet, model.upper_resistance, model.lower_resistance
        check_discs(sheet, discs.u, discs.phi, discs.radius, discs.conductance)
        k = discs.u.shape[1]
        order = int(resolution(sheet, discs, model.contrast, model.tolerance)[0])
        coupling, moments = solve_to_tolerance(sheet, upper, lower, discs, order, model.tolerance)
        order = moments.order
        strip = Strip.of(sheet.length, sheet.breadth)
        a, b = (lower, upper) if strip.along_x else (upper, lower)
        circles = make_circles(sheet, strip, discs, order, 2 * order + 2, with_images=a != b)
        size = 2 * order + 1
        block = np.empty((k, size, k, size))
        for i in range(k):
            for j in range(i + 1):
                one, _ = green_block(strip, circles, i, j, a / (a + b), b / (a + b))
                block[i, :, j, :], block[j, :, i, :] = one[0], one[0].T
        right = np.zeros((k, size, 3))
        right[:, 0, 0] = 1.0
        right[:, :, 1], right[:, :, 2] = circles.x[0], circles.y[0]
        return cls(model, discs.radius[0], order, block, right, float(coupling.error[0]))

    def coupling(self, radius: ArrayLike, conductance: ArrayLike) -> Coupling:
        """Compute the six numbers of n moments.

        Args:
            radius: of each contact [m], above 0 and at most the largest, shape (n, k).
            conductance: per area [S/m^2], above 0 to inf, shape (n, k).

        Raises:
            FieldError: a radius or a conductance out of range.
        """
        radius, conductance = np.asarray(radius, dtype=np.float64), np.asarray(conductance, dtype=np.float64)
        part = radius / self.largest
        if not ((part > 0.0) & (part <= 1.0 + 1e-12)).all():
            raise FieldError(f"radius of a contact must be above 0 and at most {self.largest} m, got {radius} m")
        if not (conductance > 0.0).all():
            raise FieldError(f"conductance of a contact must be above 0 S/m^2, got {conductance} S/m^2")
        n, k = radius.shape
        order, size = self.order, 2 * self.order + 1
        rs = self.model.upper_resistance + self.model.lower_resistance
        ka = np.sqrt(conductance * rs) * radius
        ratios = bessel_ratios(ka, order + 1)
        m = np.arange(1, order + 1)
        grown = np.sqrt(2.0 * math.pi * m * ratios[:, :, :-1] * ratios[:, :, 1:]) * part[:, :, None] ** m
        # Its own logarithm counts from the disc's rim, and the rim has moved in.
        own = 1.0 / (2.0 * math.pi * ka * ratios[:, :, 0]) - np.log(part) / (2.0 * math.pi)
        scale = np.empty((n, k, size))
        scale[:, :, 1::2] = scale[:, :, 2::2] = grown
        places = np.arange(k)
        scale[:, :, 0] = 1.0 / np.sqrt(own + self.block[places, 0, places, 0])
        matrix = scale[:, :, :, None, None] * self.block * scale[:, None, None, :, :]
        flat = matrix.reshape(n, k * size, k * size)
        diagonal = np.arange(k * size)
        flat[:, diagonal, diagonal] += 1.0
        matrix[:, places, 0, places, 0] = 1.0
        right = (self.right * scale[..., None]).reshape(n, k * size, 3)
        w = right.transpose(0, 2, 1) @ np.linalg.solve(flat, right) / rs
        centre = np.broadcast_to(self.right[:, 0, 1:].mean(axis=0), (n, 2))
        return Coupling.of_matrix(0.5 * (w + w.transpose(0, 2, 1)), centre, np.full(n, self.error))
