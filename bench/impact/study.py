"""The model against the published study of a padded skin, as far as the numbers go that could be read.

    python -m bench impact-study

Svarny et al., "Effect of Active and Passive Protective Soft Skins on Collision Forces in Human-robot Collaboration"
(arXiv 2203.09872), abstract: in 2250 collisions of a UR10e and two other arms the padding lowered transient forces by
about 40 %; in some cases four times the speed that ISO/TS 15066 prescribes kept the limits. The group's code
(ctu-vras/adaptive-skin, eff_mass.py) computes with a spring of 75 N/mm and a struck mass of 5.6 kg. Stiffness and
thickness of the skin, the fitted formula and the single measurements were not at hand.
"""

from __future__ import annotations

import math
import random

import numpy as np

from bench.report import head, quantile
from coneskin.impact.permissible_speed.taylor_integrator import integrate
from coneskin.impact.permissible_speed.two_mass_contact import DrivenArm, StruckBody, TwoMassContact
from coneskin.robot.arm.inertia import arm_inertia
from coneskin.robot.arm.models import arm_model
from coneskin.skin.materials import Padding
from tests.support.effective_mass import effective_mass

SPRING, STRUCK = 75e3, 5.6  # N/m, kg; as the group's code has them
BARE_PADDING = Padding(thickness=1.0, stiffness=1e9, loss=0.0)


def peak(speed: float, mass: float, padding: Padding) -> float:
    """Return the peak force of a free arm on the free struck mass [N]."""
    contact = TwoMassContact(DrivenArm(speed, mass), StruckBody(STRUCK, tissue=SPRING), padding)
    return integrate(contact, 0.2, keep=False).peak


def main() -> None:
    print(head("numpy"))
    model = arm_model("UR10e")
    inertia = arm_inertia(model)
    whole = sum(link.mass for link in inertia.links)
    print(f"UR10e: moving mass {whole:.1f} kg; half of it, as ISO/TS 15066 takes it without a load: {whole / 2:.1f} kg")
    bare = peak(0.3, whole / 2, BARE_PADDING)
    print(f"bare at 0.3 m/s: {bare:.0f} N; formula v sqrt(mu k): {_formula(0.3, whole / 2):.0f} N")
    print("padding of 12 mm, of a stiffness; force at 0.3 m/s over the bare one; speed with the bare one's force:")
    for stiffness in (20e3, 42.2e3, 100e3):
        for loss in (0.0, 0.5):
            padding = Padding(12e-3, stiffness, 1e6, loss)
            share = peak(0.3, whole / 2, padding) / bare
            low, high = 0.3, 3.0
            while high - low > 1e-4:
                middle = 0.5 * (low + high)
                low, high = (middle, high) if peak(middle, whole / 2, padding) <= bare else (low, middle)
            print(f"  {1e-3 * stiffness:6.1f} N/mm, loss {loss:3.1f} s/m: {share - 1:+7.1%} {low / 0.3:7.2f} x")
    chance = random.Random(0)
    ratios = []
    for _ in range(400):
        q = [chance.uniform(-math.pi, math.pi) for _ in range(6)]
        direction = np.array([chance.gauss(0.0, 1.0) for _ in range(3)])
        mass = effective_mass(model, inertia, q, 6, (0.0, 0.0, 0.0), tuple(direction))
        ratios.append(_formula(0.3, whole / 2) / _formula(0.3, mass))
    print("speed with the effective mass of the flange over that with half the arm's, at the same force:")
    print(f"  median {quantile(ratios, 0.5):.2f} x, 95 % {quantile(ratios, 0.95):.2f} x, most {max(ratios):.2f} x")
    print(f"both together, with 42 N/mm: median {quantile(ratios, 0.5) / 0.6:.1f} x, most {max(ratios) / 0.6:.1f} x")


def _formula(speed: float, mass: float) -> float:
    return speed * math.sqrt(SPRING / (1.0 / mass + 1.0 / STRUCK))
