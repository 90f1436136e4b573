"""What the tests of the physics look at within a plant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from coneskin.impact.simulation.mujoco_plant import MujocoPlant
from coneskin.skin.materials import Padding

from .stored_energy import stored_energy


def switch_off(plant: MujocoPlant, joints: Sequence[int]) -> None:
    """Switch the servos of joints off, numbered from 0."""
    for joint in joints:
        plant._m.actuator_gainprm[joint] = plant._m.actuator_biasprm[joint] = 0.0


def plant_mass_matrix(plant: MujocoPlant) -> NDArray[np.float64]:
    """Return the mass matrix of the arm at its present position [kg m^2], 6 x 6."""
    columns = np.zeros((6, plant._m.nv))
    for joint, unit in enumerate(np.eye(6, plant._m.nv)):
        plant._mj.mj_mulM(plant._m, plant._d, columns[joint], unit)
    return columns[:, :6]


def plant_momentum(plant: MujocoPlant) -> NDArray[np.float64]:
    """Return linear momentum [N s] and angular momentum about the base [N m s] of all that moves, shape (6,).

    The rotors of the motors are not in it: they turn about their own axes.
    """
    m, d, linear, angular = plant._m, plant._d, np.zeros(3), np.zeros(3)
    for body in range(1, m.nbody):
        spin = np.zeros(6)
        plant._mj.mj_objectVelocity(m, d, plant._mj.mjtObj.mjOBJ_BODY, body, spin, 0)
        mass, axes = m.body_mass[body], d.ximat[body].reshape(3, 3)
        linear += mass * spin[3:]
        angular += axes @ (m.body_inertia[body] * (axes.T @ spin[:3]))
        angular += np.cross(d.xipos[body], mass * spin[3:])
    return np.concatenate([linear, angular])


def part_velocity(plant: MujocoPlant, part: int) -> list[float]:
    """Return the velocity of a part that moves [m/s]."""
    at = plant._address[part]
    assert at is not None
    velocity: list[float] = plant._d.qvel[at : at + 3].tolist()
    return velocity


def account_for_energy(plant: MujocoPlant, q: Sequence[float], qd: Sequence[float], duration: float) -> list[float]:
    """Let time pass in pieces of 0.1 ms; return the energy before [J], and after with what damping has taken."""
    padding: Padding = plant._padding
    lost, rate, step = 0.0, _damped_power(plant, padding), 1e-4
    before = _energy(plant, padding)
    for number in range(round(duration / step)):
        plant.update([at + number * step * speed for at, speed in zip(q, qd, strict=True)], qd, step)
        last, rate = rate, _damped_power(plant, padding)
        lost += 0.5 * step * (last + rate)
    return [before, _energy(plant, padding) + lost]


def _energy(plant: MujocoPlant, padding: Padding) -> float:
    """Return the energy of motion, of springs and of the padding [J]."""
    plant._mj.mj_energyPos(plant._m, plant._d)
    plant._mj.mj_energyVel(plant._m, plant._d)
    stored = sum(stored_energy(padding, contact.depth) for contact in plant.contacts)
    return float(plant._d.energy[0] + plant._d.energy[1]) + stored


def _damped_power(plant: MujocoPlant, padding: Padding) -> float:
    """Return what damping in padding and springs takes [W]."""
    taken = sum((each.force - padding.elastic(each.depth)) * each.rate for each in plant.contacts)
    for _, at in plant._moving:
        taken += float(plant._m.dof_damping[at]) * float(np.sum(plant._d.qvel[at : at + 3] ** 2))
    return taken
