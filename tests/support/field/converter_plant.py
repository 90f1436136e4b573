"""Plant of the electronics: counts of a converter from the sheets' four-port, by nodal analysis of the whole circuit.

Eight nodes, the four electrodes and the four terminals of the board, and a lead between each two: no formula of a
decoder, and none of the virtual skin, is used. Many scenes at once; each with leads, supply and noise of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_SWITCH = 1e-3  # ohm; between a terminal and the rail that it is switched to
_PHASES = ("bb..", "gb..", "..bg")  # of A, B, C, D: b to the supply, g to ground, a dot to what is read


@dataclass(frozen=True, slots=True)
class ConverterPlant:
    """Electronics with B and C positive.

    Attributes:
        supply: potential of the rail [V].
        adc: input that gives the highest count [V].
        bits: of the converter.
        full_scale: current that gives the highest count [A].
        pulldown: from C and from D to ground in the touch phase [ohm].
        input: from each terminal that is read to ground in the other phases [ohm].
        leads: of A, B, C, D [ohm].
        noise: standard deviation of each count.
        phase_supply: supply in the touch, radial and angular phase, over the one that is measured.
    """

    supply: float = 2.5
    adc: float = 3.3
    bits: int = 12
    full_scale: float = 0.02
    pulldown: float = 10e3
    input: float = 10e6
    leads: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    noise: float = 0.7
    phase_supply: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def exact(self, admittance: Array) -> Array:
        """Return the ten counts before noise and rounding, in the order of the wire, shape (..., 10).

        Args:
            admittance: Y of A, B, C, D [S], shape (..., 4, 4).
        """
        full = float(2**self.bits - 1)
        out = np.empty((*admittance.shape[:-2], 10))
        for number, (phase, share) in enumerate(zip(_PHASES, self.phase_supply, strict=True)):
            supply = self.supply * share
            nodes = np.zeros((*admittance.shape[:-2], 8, 8))
            nodes[..., :4, :4] = admittance
            feed = np.zeros(8)
            read = [k for k in range(4) if phase[k] == "."]
            for k in range(4):
                lead = 1.0 / self.leads[k]
                nodes[..., k, k] += lead
                nodes[..., 4 + k, 4 + k] += lead
                nodes[..., k, 4 + k] -= lead
                nodes[..., 4 + k, k] -= lead
                to_ground = 1.0 / (self.pulldown if number == 0 else self.input) if k in read else 1.0 / _SWITCH
                nodes[..., 4 + k, 4 + k] += to_ground
                feed[4 + k] = supply / _SWITCH if phase[k] == "b" else 0.0
            at = np.linalg.solve(nodes, np.broadcast_to(feed, nodes.shape[:-1])[..., None])[..., 0]
            drawn = sum((at[..., 4 + k] - at[..., k]) / self.leads[k] for k in range(4) if phase[k] == "b")
            for place, k in enumerate(read):
                out[..., 3 * number + place] = at[..., 4 + k] * full / self.adc
            out[..., 3 * number + 2] = drawn * full / self.full_scale
        out[..., 9] = self.supply * full / self.adc
        return out

    def counts(self, exact: Array, frames: int, rng: np.random.Generator) -> NDArray[np.int64]:
        """Return noisy frames of each scene, shape (..., frames, 10)."""
        full = 2**self.bits - 1
        shape = (*exact.shape[:-1], frames, 10)
        noisy = exact[..., None, :] + rng.normal(0.0, self.noise, shape)
        return np.clip(np.rint(noisy), 0, full).astype(np.int64)


def leak_admittance(siemens: float) -> Array:
    """Return what a leak that is spread evenly in the conformal rectangle adds to Y [S], much smaller than the sheets.

    The potentials are linear there: the mean of f f^T over the unit square, f = (x, 1 - x, -y, y - 1).
    """
    nodes, weights = np.polynomial.legendre.leggauss(2)
    nodes, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    x, y = (grid.ravel() for grid in np.meshgrid(nodes, nodes))
    field = np.array([x, 1.0 - x, -y, y - 1.0])
    return np.asarray(siemens * (field * np.outer(weights, weights).ravel()) @ field.T)
