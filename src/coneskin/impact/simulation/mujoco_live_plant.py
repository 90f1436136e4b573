"""Plant for real time: where skins and bodies meet is looked for every millisecond, not at each integration step.

Between two looks place and normal of a contact stay, and its indentation grows with the speeds. That takes a third of
the time of `MujocoPlant`, which looks at each step, and has its forces within a few per cent (tests/impact/simulation).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .mujoco_plant import MujocoPlant, Touch

__all__ = ["LiveMujocoPlant"]

_LOOK = 5  # steps of the integration from one look to the next
_NEAR = 0.002  # m between two surfaces that may meet before the next look; as far as MuJoCo reports it


class LiveMujocoPlant(MujocoPlant):
    """Plant of one arm and its surroundings in real time; arguments and attributes as of `MujocoPlant`.

    ``lost`` stays 0: energy is not accounted for.
    """

    def advance(self, q: Sequence[float], qd: Sequence[float], duration: float) -> None:
        """Let time pass while the controller's targets move evenly; see `MujocoPlant.advance`."""
        m, d, step, padding = self._m, self._d, self._step, self._padding
        step1, step2 = self._mj.mj_step1, self._mj.mj_step2
        no_contacts = int(self._mj.mjtDisableBit.mjDSBL_CONTACT)
        speed = np.asarray(qd, float)
        moved, target = step * speed, np.asarray(q, float) + self._lead * speed
        arm, control, applied, velocity = len(speed), d.ctrl, d.qfrc_applied, d.qvel
        near: list[tuple[Touch, NDArray[np.float64]]] = []
        for number in range(round(duration / step)):
            look = number % _LOOK == 0
            m.opt.disableflags = 0 if look else no_contacts
            step1(m, d)
            if look:
                near = [(touch, self._row(touch)) for touch in self._find(_NEAR)]
                depths = [touch.depth for touch, _ in near]
            control[:arm] = target
            applied[:] = 0.0
            felt: dict[int, Touch] = {}
            for at, (touch, row) in enumerate(near):
                rate = float(row @ velocity)
                depth = depths[at]
                depths[at] = depth + rate * step
                if depth <= 0.0:
                    continue
                force = padding.force(depth, rate)
                applied -= force * row
                self.impulse += force * step
                self.deepest, self.peak = max(self.deepest, depth), max(self.peak, force)
                self._touched.setdefault(self._body_numbers[touch.part], self.time)
                if touch.part not in felt or felt[touch.part].force < force:
                    felt[touch.part] = touch._replace(force=force)
            self._let_people_act(felt)
            step2(m, d)
            target += moved
            self.time += step
        m.opt.disableflags = 0
        self._look()

    def _row(self, touch: Touch) -> NDArray[np.float64]:
        """Return what gives the rate of an indentation from all speeds, and the forces on all of them from its own."""
        row: NDArray[np.float64] = np.zeros(self._m.nv)
        row[: touch.jacobian.shape[1]] = touch.normal @ touch.jacobian
        if (at := self._address[touch.part]) is not None:
            row[at : at + 3] = -touch.normal
        return row
