"""Map of permissible speeds over the skins of an arm: which part of which link may move how fast.

A patch has a speed for each lever, the ratio of its speed along the normal and that of the leading joint: with a short
one, that joint turns fast, brakes for long, and the surface goes far. The mass of a patch is the heaviest in the
positions of the scene's motion; where the arm may be anywhere it may be any. The force nearly always grows with the
mass, but servos swing, so that the least speed of all masses in the range counts. What the surface goes beyond the way
of one driven mass is the most of those positions (``extra_way``), or of a sample of all.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from coneskin.core.errors import SceneError
from coneskin.core.files import explain_os_error, write_whole
from coneskin.core.version import __version__
from coneskin.robot.arm.kinematics import link_index
from coneskin.robot.arm.models import arm_model
from coneskin.scene.tables.keys import SPEED_LIMIT_KEYS
from coneskin.scene.tables.speed_limit_tables import limit_digest, limit_fingerprint
from coneskin.scene.values.scene import LimitedPatch, Scene, SpeedLimitScene
from coneskin.skin.materials import Padding

from .arm_patches import ArmPatch, braking_held, inertias_of, motion_positions, patches_of, weigh
from .extra_way import ExtraWay, extra_ways
from .limits_file import BodyRegion, ForceLimits, LimitsFile, MeasuredReaction
from .taylor_integrator import integrate
from .two_mass_contact import DrivenArm, TwoMassContact

#: m/s; no faster speed is looked at
_TOP_SPEED = 5.0
#: m/s; below, no speed counts as permissible
_LEAST_SPEED = 1e-3
_SPEED_TOLERANCE = 4e-3  # of the speed that is found


def _keeps(model: TwoMassContact, limits: ForceLimits) -> bool:
    if model.static(model.arm.stopping_way)[0] > limits.lasting:
        return False  # known without a look at the course: the time to the closing makes it no better
    course = integrate(model, keep=False, stop_above=limits.transient)
    return course.peak <= limits.transient and max(course.last, course.rest) <= limits.lasting


def permissible_speed(
    at_speed: Callable[[float], Sequence[TwoMassContact]],
    limits: ForceLimits,
    least: float = _LEAST_SPEED,
    top: float = _TOP_SPEED,
) -> float:
    """Return the highest speed up to which contacts keep limits [m/s]; 0 where none of 1 mm/s or more does.

    Force grows with speed; so it is searched by halving, and what is returned was looked at and keeps them.

    Args:
        at_speed: makes the contacts at a speed [m/s], all of which must keep them.
        least: speed from which to look on [m/s]; where it does not keep them, from the lowest on.
        top: highest speed to look at [m/s].
    """

    def all_keep(speed: float) -> bool:
        return all(_keeps(contact, limits) for contact in at_speed(speed))

    if all_keep(top):
        return top
    low, high = least, top
    if not all_keep(low):
        low, high = _LEAST_SPEED, least
        if low == high or not all_keep(low):
            return 0.0
    while high > low * (1.0 + _SPEED_TOLERANCE):
        middle = math.sqrt(low * high)
        if all_keep(middle):
            low = middle
        else:
            high = middle
    return low


def _speed_within_spread(
    at_speed: Callable[[float, Padding], Sequence[TwoMassContact]],
    padding: Padding,
    limits: ForceLimits,
    least: float = _LEAST_SPEED,
    top: float = _TOP_SPEED,
) -> float:
    """Return the highest speed up to which contacts keep limits with each padding within the spread of one [m/s].

    The softest is pressed the deepest; there, the force of another is at most (1 + spread) / (1 - spread) times its.
    A body that swings may meet another padding harder all the same, or a contact beside the first: what is found with
    the softest and the first is looked at with all contacts, and with the padding of the table and the stiffest.

    Args:
        at_speed: makes the contacts at a speed [m/s] with a padding, all of which must keep them.
        padding: as its table says.
        least, top: as of `permissible_speed`.
    """
    low, high = 1.0 - padding.spread, 1.0 + padding.spread
    tight = ForceLimits(low / high * limits.transient, low / high * limits.lasting)
    soft = padding.scaled(low)
    found = permissible_speed(lambda speed: at_speed(speed, soft)[:1], tight, least, top)
    for foam, kept in ((soft, tight), (padding, limits), (padding.scaled(high), limits)):
        if found > 0.0 and not all(_keeps(contact, kept) for contact in at_speed(found, foam)):
            found = permissible_speed(lambda speed, foam=foam: at_speed(speed, foam), kept, least, found)  # type: ignore[misc]
    return found


#: m/rad; a UR20 reaches 1.75 m
LEVERS = (0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28, 1.8)
#: kg; a range of masses is looked at at these within it, and at the next beyond
_CURVE_MASSES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, math.inf)
_IMMOVABLE_MASS = 1e6  # kg; no contact slows it down, but where it brakes it goes beyond as its servos do
_NO_WAY = ExtraWay()
_POSITION_COUNT = 300  # joint positions that are looked at where the arm may be anywhere
_SAMPLING_FACTOR = 1.1  # factor for what they may miss of the most
_LEAST_BRAKING = 0.1  # rad/s^2; less counts as none
_MAX_CONTACT_SPEED = 100.0  # m/s of a contact
_MOTION_MARGIN = 0.05  # rad around a motion, within which its curves hold


@dataclass(frozen=True, slots=True)
class _SpeedCurve:
    """Permissible speeds for a range of masses."""

    region: str  #: of the body that allows the least, at the longest lever
    mass: float  #: heaviest of the arm [kg]
    extra: ExtraWay  #: way that a surface goes at most beyond that of one driven mass
    speeds: tuple[float, ...]  #: for each of ``LEVERS`` [m/s]


@dataclass(frozen=True, slots=True)
class SpeedMap:
    """Map of one scene."""

    table: SpeedLimitScene  #: as a scene takes it
    curves: tuple[_SpeedCurve, ...]  #: of the table
    patches: tuple[ArmPatch, ...]  #: of the skins, in the order of the table
    masses: tuple[float, ...]  #: of the arm at each patch [kg], the heaviest


def contact_at(
    speed: float,
    lever: float,
    mass: float,
    region: BodyRegion,
    measured: MeasuredReaction,
    padding: Padding,
    extra: ExtraWay = _NO_WAY,
) -> TwoMassContact:
    """Return the contact of a patch with a part of a body.

    Args:
        speed: of the patch along its normal [m/s].
        lever: that speed over that of the leading joint [m/rad].
        mass: of the arm there [kg].
        extra: way of the patch: the arm brakes as much later as it overshoots further, and moves with the mean lever of
            its way.
    """
    turn = 2.0 * math.pi * measured.servo
    mass = min(mass, _IMMOVABLE_MASS)
    servo = mass * turn * turn, 2.0 * mass * turn
    reaction = measured.reaction + extra.delay(speed, lever, measured.deceleration, turn)

    def driven(stretch: float) -> TwoMassContact:
        towards = min(stretch * speed, _MAX_CONTACT_SPEED)
        return TwoMassContact(
            DrivenArm(towards, mass, *servo, reaction=reaction, deceleration=stretch * measured.deceleration * lever),
            region.body,
            padding,
        )

    straight = driven(1.0)
    if extra.bend <= 0.0 or speed <= 0.0:
        return straight
    closing = straight.way_to_close
    if math.isinf(closing):  # of a free body: by the padding alone
        closing = straight.law.under(straight.closing_force)
    rate = speed / lever
    angle = closing / lever + rate * reaction + 0.5 * rate * rate / measured.deceleration
    return driven(extra.stretch(angle, lever))


def map_speeds(
    scene: Scene, limits: LimitsFile, *, any_position: bool = False, note: Callable[[str], None] = lambda _: None
) -> SpeedMap:
    """Return the map of a scene.

    Args:
        scene: with an arm, skins, and its [padding].
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
    assert scene.arm is not None  # or there were no patches
    arm = arm_model(scene.arm.model)
    inertias, chance = inertias_of(scene.arm), random.Random(0)
    positions = [tuple(chance.uniform(-math.pi, math.pi) for _ in range(arm.joints)) for _ in range(_POSITION_COUNT)]
    everywhere = extra_ways(arm, patches, positions, inertias)
    extras = everywhere
    braking = limits.measured.deceleration
    any_braking = held = min(braking, max(_LEAST_BRAKING, braking_held(arm, positions, inertias) / _SAMPLING_FACTOR))
    lowest: tuple[float, ...] = ()
    highest: tuple[float, ...] = ()
    if not free and scene.motion is not None:
        positions = motion_positions(scene)
        weights = weigh(arm, patches, positions, inertias)
        extras = extra_ways(arm, patches, positions, inertias)
        held = min(braking, braking_held(arm, positions, inertias))
        if held < _LEAST_BRAKING:
            why = (
                f"{scene.arm.payload:g} kg at payload_xyz_mm are too much for the motors in a position of the [motion]"
            )
            raise SceneError([f"{why}: they hold no braking of {_LEAST_BRAKING:g} rad/s2"], scene.name)
        lightest, masses = weights.min(axis=0).tolist(), weights.max(axis=0).tolist()
        lowest = tuple(min(values) - _MOTION_MARGIN for values in zip(*scene.motion.waypoints, strict=True))
        highest = tuple(max(values) + _MOTION_MARGIN for values in zip(*scene.motion.waypoints, strict=True))
    maker = _CurveMaker(limits, padding, note)
    rows = []
    most = {link: _most([*extras, *everywhere], link, patches) for link in {patch.link for patch in patches}}
    for patch, light, heavy, extra in zip(patches, lightest, masses, extras, strict=True):
        anywhere = maker.number(patch.link, 0.0, math.inf, most[patch.link], any_braking)
        nearer = extra.rounded_up().up_to(most[patch.link])
        own = anywhere if free else maker.number(patch.link, light, heavy, nearer, held)
        rows.append(LimitedPatch(patch.sensor, patch.u, patch.phi, own, anywhere))
    found = maker.curves
    for curve in found:
        if curve.speeds[-1] <= 0.0:
            why = f"no speed of 1 mm/s or more keeps the limits of {curve.region}: a softer or thicker padding, a"
            raise SceneError([f"{why} shorter reaction or a harder braking is needed"], scene.name)
    table = SpeedLimitScene(
        fingerprint=limit_fingerprint(scene),
        date=f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}",
        coneskin=__version__,
        edition=limits.edition,
        transcribed_by=limits.transcribed_by,
        verified_by=limits.verified_by,
        measured_by=limits.measured.by,
        reaction=limits.measured.reaction,
        deceleration=held,
        lowest=lowest,
        highest=highest,
        levers=LEVERS,
        curves=tuple(curve.speeds for curve in found),
        patches=tuple(rows),
    )
    return SpeedMap(table, tuple(found), tuple(patches), tuple(masses))


def _most(extras: Sequence[ExtraWay], link: int, patches: Sequence[ArmPatch]) -> ExtraWay:
    """Return the most of the ways of a link's patches, and what a sample may miss."""
    own = [extra for extra, patch in zip(extras, (*patches, *patches), strict=True) if patch.link == link]
    lag, bend = max(extra.lag for extra in own), max(extra.bend for extra in own)
    return ExtraWay(_SAMPLING_FACTOR * lag, _SAMPLING_FACTOR * bend)


class _CurveMaker:
    """Maker of curves, each of them once."""

    def __init__(self, limits: LimitsFile, padding: Padding, note: Callable[[str], None]) -> None:
        self.curves: list[_SpeedCurve] = []
        self._limits, self._note = limits, note
        self._padding = padding
        self._number, self._search = cache(self._new_number), cache(self._new_search)

    def number(self, link: int, lightest: float, heaviest: float, extra: ExtraWay, braking: float) -> int:
        """Return the number of a link's curve, for a range of masses [kg], an extra way and a braking [rad/s^2]."""
        regions = tuple(region for region in self._limits.regions if not region.links or link in region.links)
        first = max((n for n, mass in enumerate(_CURVE_MASSES) if mass <= lightest), default=0)
        last = min(n for n, mass in enumerate(_CURVE_MASSES) if mass >= heaviest)
        return self._number(regions, _CURVE_MASSES[first : last + 1], extra, braking)

    def _new_number(
        self, regions: tuple[BodyRegion, ...], masses: tuple[float, ...], extra: ExtraWay, braking: float
    ) -> int:
        found = [(self._search(region, mass, extra, braking), region.name) for region in regions for mass in masses]
        least = min((row[-1], name) for row, name in found)[1]
        speeds = zip(*(row for row, _ in found), strict=True)
        curve = _SpeedCurve(least, masses[-1], extra, tuple(map(min, speeds)))
        if curve not in self.curves:
            self.curves.append(curve)
        return self.curves.index(curve)

    def _new_search(self, region: BodyRegion, mass: float, extra: ExtraWay, braking: float) -> tuple[float, ...]:
        """Return the permissible speeds of one mass against one region, for each lever."""
        self._note(f"{region.name} struck by {mass:g} kg")
        speeds: list[float] = []
        measured = replace(self._limits.measured, deceleration=braking)
        for number, lever in enumerate(LEVERS):

            def contacts(speed: float, padding: Padding, lever: float = lever) -> list[TwoMassContact]:
                common = region, measured, padding  # a body that swings may meet a shorter way harder
                return [contact_at(speed, lever, mass, *common, way) for way in (extra, _NO_WAY)]

            least, top = _LEAST_SPEED, _TOP_SPEED
            if number and speeds[-1] > 0.0:  # a longer lever brakes sooner, but not by more than it is longer
                least, top = speeds[-1], min(_TOP_SPEED, 1.01 * speeds[-1] * lever / LEVERS[number - 1])
            speeds.append(_speed_within_spread(contacts, self._padding, region.limits, least, top))
        for number in reversed(range(len(speeds) - 1)):  # what the search leaves of a fall is taken off
            speeds[number] = min(speeds[number], speeds[number + 1])
        return tuple(speeds)


def _check(scene: Scene, limits: LimitsFile) -> None:
    problems = []
    if scene.padding is None:
        problems.append(
            "permissible speeds need the [padding] of the skins; press yours on a scale (docs/do/padding.md)"
        )
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
            index = link_index(item.name)
            if index and item.sensors and not any(not r.links or index in r.links for r in limits.regions):
                problems.append(f"no [[limits.region]] may be struck by the {item.name}, which has a skin")
    if problems:
        raise SceneError(problems, scene.name)


_FILE_HEADER = """\
# Permissible speeds of a scene's skins, written by `coneskin permissible`. No safety assessment.
# A scene takes them with speed_limit_from in [arm]. Change the limits, not this file, and write it anew.
"""


def map_table(found: SpeedMap) -> dict[str, Any]:
    """Return the table of a map, in the units of the file."""
    table = found.table
    values: dict[str, Any] = {key.name: getattr(table, key.name) for key in SPEED_LIMIT_KEYS[1:] if key.kind is str}
    values |= {"reaction_ms": 1e3 * table.reaction, "deceleration_rad_s2": table.deceleration}
    if table.lowest:
        values["lowest_deg"] = [math.degrees(q) for q in table.lowest]
        values["highest_deg"] = [math.degrees(q) for q in table.highest]
    values["levers_mm"] = [1e3 * lever for lever in table.levers]
    values["curve"] = [
        {"region": curve.region}
        | ({} if math.isinf(curve.mass) else {"mass_kg": curve.mass})
        | {"lag_mm": 1e3 * curve.extra.lag, "bend_mm": 1e3 * curve.extra.bend}
        | {"speeds_mm_s": [math.floor(1e5 * speed) / 1e2 for speed in curve.speeds]}
        for curve in found.curves
    ]
    values["patch"] = [
        {
            "sensor": patch.sensor,
            "u_mm": round(1e3 * patch.u, 6),
            "phi_deg": round(math.degrees(patch.phi), 6),
            "curve": patch.curve,
            "any_curve": patch.any_curve,
        }
        for patch in table.patches
    ]
    return {"speed_limit": {"digest": limit_digest(values)} | values}


def write_map(found: SpeedMap, path: Path) -> None:
    """Write the file of a map, whole or not at all.

    Raises:
        SceneError: it cannot be written.
    """
    import tomli_w

    with explain_os_error(lambda why: SceneError([why], path.name), f"the speeds {path} cannot be written"):
        write_whole(path, _FILE_HEADER + tomli_w.dumps(map_table(found)))
