"""Map of permissible speeds over the skins of an arm: which part of which link may move how fast.

A patch has a speed for each lever, the ratio of its speed along the normal and that of the leading joint: with a short
one, that joint turns fast, brakes for long, and the surface goes far. The mass of a patch is the heaviest in the
positions of the scene's motion; where the arm may be anywhere it may be any. The force nearly always grows with the
mass, but servos swing, so that the least speed of all masses in the range counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from coneskin import __version__
from coneskin.errors import SceneError
from coneskin.scene.speed_limit import LimitedPatch, SpeedLimitScene
from coneskin.scene.tables.speed_limit_table import limit_fingerprint
from coneskin.skin.padding import Padding

from .arm_patches import motion_positions, patches_of, weigh
from .limits_file import BodyRegion, LimitsFile, MeasuredReaction
from .speed_search import LEAST_SPEED, TOP_SPEED, permissible_speed
from .two_mass_contact import DrivenArm, TwoMassContact

if TYPE_CHECKING:
    from coneskin.scene.scene import Scene

    from .arm_patches import ArmPatch

__all__ = ["LEVERS", "SpeedCurve", "SpeedMap", "contact_at", "map_speeds"]

#: m/rad; a UR20 reaches 1.75 m
LEVERS = (0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28, 1.8)
#: kg; a range of masses is looked at at these within it, and at the next beyond
_MASSES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, math.inf)
_IMMOVABLE = 1e6  # kg; no contact slows it down, but where it brakes it goes beyond as its servos do
_MARGIN = 0.05  # rad around a motion, within which its curves hold


@dataclass(frozen=True, slots=True)
class SpeedCurve:
    """Permissible speeds for a range of masses.

    Attributes:
        region: of the body that allows the least, at the longest lever.
        mass: heaviest of the arm [kg].
        speeds: for each of ``LEVERS`` [m/s].
    """

    region: str
    mass: float
    speeds: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class SpeedMap:
    """Map of one scene.

    Attributes:
        table: as a scene takes it.
        curves: of the table.
        patches: of the skins, in the order of the table.
        masses: of the arm at each patch [kg], the heaviest.
    """

    table: SpeedLimitScene
    curves: tuple[SpeedCurve, ...]
    patches: tuple[ArmPatch, ...]
    masses: tuple[float, ...]


def contact_at(
    speed: float, lever: float, mass: float, region: BodyRegion, measured: MeasuredReaction, padding: Padding
) -> TwoMassContact:
    """Return the contact of a patch with a part of a body.

    Args:
        speed: of the patch along its normal [m/s].
        lever: that speed over that of the leading joint [m/rad].
        mass: of the arm there [kg].
        region: that is struck.
        measured: how the arm stops.
        padding: of the skin.
    """
    turn = 2.0 * math.pi * measured.servo
    mass = min(mass, _IMMOVABLE)
    servo = mass * turn * turn, 2.0 * mass * turn
    arm = DrivenArm(speed, mass, *servo, reaction=measured.reaction, deceleration=measured.deceleration * lever)
    return TwoMassContact(arm, region.body, padding)


def map_speeds(
    scene: Scene, limits: LimitsFile, *, any_position: bool = False, note: Callable[[str], None] = lambda _: None
) -> SpeedMap:
    """Return the map of a scene.

    Args:
        scene: with an arm, skins, and its [padding].
        limits: to be kept.
        any_position: True to let the arm be anywhere, also where the scene has a [motion].
        note: is told what is being computed.

    Raises:
        SceneError: the scene lacks something, a reaction does not stop the arm or brakes less than was measured, no
            region can be struck by a link, or no speed keeps the limits.
    """
    _check(scene, limits)
    patches = patches_of(scene)
    padding = scene.padding or Padding()
    free = any_position or scene.motion is None
    lightest, masses = [0.0] * len(patches), [math.inf] * len(patches)
    lowest: tuple[float, ...] = ()
    highest: tuple[float, ...] = ()
    if not free and scene.motion is not None and scene.arm is not None:
        weights = weigh(scene.arm.model, patches, motion_positions(scene))
        lightest, masses = weights.min(axis=0).tolist(), weights.max(axis=0).tolist()
        lowest = tuple(min(values) - _MARGIN for values in zip(*scene.motion.waypoints, strict=True))
        highest = tuple(max(values) + _MARGIN for values in zip(*scene.motion.waypoints, strict=True))
    maker = _CurveMaker(limits, padding, note)
    rows = []
    for patch, light, heavy in zip(patches, lightest, masses, strict=True):
        own, anywhere = maker.number(patch.link, light, heavy), maker.number(patch.link, 0.0, math.inf)
        rows.append(LimitedPatch(patch.sensor, patch.u, patch.phi, own, anywhere))
    found = maker.curves
    _check_speeds(scene, found)
    table = SpeedLimitScene(
        format=1,
        fingerprint=limit_fingerprint(scene),
        date=f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}",
        coneskin=__version__,
        edition=limits.edition,
        transcribed_by=limits.transcribed_by,
        verified_by=limits.verified_by,
        measured_by=limits.measured.by,
        reaction=limits.measured.reaction,
        deceleration=limits.measured.deceleration,
        lowest=lowest,
        highest=highest,
        levers=LEVERS,
        curves=tuple(curve.speeds for curve in found),
        patches=tuple(rows),
    )
    return SpeedMap(table, tuple(found), tuple(patches), tuple(masses))


class _CurveMaker:
    """Maker of curves, each of them once."""

    def __init__(self, limits: LimitsFile, padding: Padding, note: Callable[[str], None]) -> None:
        self.curves: list[SpeedCurve] = []
        self._limits, self._padding, self._note = limits, padding, note
        self._numbers: dict[tuple[tuple[BodyRegion, ...], tuple[float, ...]], int] = {}
        self._speeds: dict[tuple[BodyRegion, float], tuple[float, ...]] = {}  # two regions may have one name

    def number(self, link: int, lightest: float, heaviest: float) -> int:
        """Return the number of the curve of a link, for a range of masses [kg]."""
        regions = tuple(region for region in self._limits.regions if not region.links or link in region.links)
        first = max((n for n, mass in enumerate(_MASSES) if mass <= lightest), default=0)
        last = min(n for n, mass in enumerate(_MASSES) if mass >= heaviest)
        masses = _MASSES[first : last + 1]
        key = regions, masses
        if key not in self._numbers:
            least = min((self._search(r, mass)[-1], r.name) for r in regions for mass in masses)[1]
            speeds = zip(*(self._search(region, mass) for region in regions for mass in masses), strict=True)
            curve = SpeedCurve(least, masses[-1], tuple(map(min, speeds)))
            if curve not in self.curves:
                self.curves.append(curve)
            self._numbers[key] = self.curves.index(curve)
        return self._numbers[key]

    def _search(self, region: BodyRegion, mass: float) -> tuple[float, ...]:
        """Return the permissible speeds of one mass against one region, for each lever."""
        key = region, mass
        if key not in self._speeds:
            self._note(f"{region.name} struck by {mass:g} kg")
            speeds: list[float] = []
            for number, lever in enumerate(LEVERS):

                def contact(speed: float, lever: float = lever) -> TwoMassContact:
                    return contact_at(speed, lever, mass, region, self._limits.measured, self._padding)

                least, top = LEAST_SPEED, TOP_SPEED
                if number and speeds[-1] > 0.0:  # a longer lever brakes sooner, but not by more than it is longer
                    least, top = speeds[-1], min(TOP_SPEED, 1.01 * speeds[-1] * lever / LEVERS[number - 1])
                speeds.append(permissible_speed(contact, region.limits, least, top))
            for number in reversed(range(len(speeds) - 1)):  # what the search leaves of a fall is taken off
                speeds[number] = min(speeds[number], speeds[number + 1])
            self._speeds[key] = tuple(speeds)
        return self._speeds[key]


def _check(scene: Scene, limits: LimitsFile) -> None:
    problems = []
    if scene.padding is None:
        problems.append("permissible speeds need the [padding] of the skins; press yours on a scale (docs/physics.md)")
    for reaction in (scene.default_reaction, *(rule.reaction for rule in scene.rules)):
        braking = reaction.deceleration
        if reaction.kind == "slow":
            problems.append("permissible speeds are those of an arm that stops when it is touched; a reaction is slow")
        if braking < limits.measured.deceleration:
            problems.append(
                f"measured.deceleration_rad_s2 = {limits.measured.deceleration:g} must not be above what the scene "
                f"asks for, deceleration_rad_s2 = {braking:g}: the arm would brake less"
            )
    if scene.arm is not None:
        for item in scene.links:
            from coneskin.robot.arm.link_frames import link_index

            index = link_index(item.name)
            if index and item.sensors and not any(not r.links or index in r.links for r in limits.regions):
                problems.append(f"no [[limits.region]] may be struck by the {item.name}, which has a skin")
    if problems:
        raise SceneError(problems, scene.name)


def _check_speeds(scene: Scene, curves: list[SpeedCurve]) -> None:
    for curve in curves:
        if curve.speeds[-1] <= 0.0:
            raise SceneError(
                [
                    f"no speed of 1 mm/s or more keeps the limits of {curve.region}: a softer or thicker padding, a "
                    "shorter reaction or a harder braking is needed"
                ],
                scene.name,
            )
