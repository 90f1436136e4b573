"""Permissible speeds of a scene's skins, as the guard keeps them: values of the table [speed_limit]."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["LimitedPatch", "SpeedLimitScene"]


@dataclass(frozen=True, slots=True)
class LimitedPatch:
    """Patch of a skin whose speed is limited.

    Attributes:
        sensor: its name.
        u: slant distance from end 1 [m].
        phi: azimuth [rad].
        curve: number of the curve that holds within the joint positions of the motion.
        any_curve: number of the one that holds in any.
    """

    sensor: str
    u: float
    phi: float
    curve: int
    any_curve: int


@dataclass(frozen=True, slots=True)
class SpeedLimitScene:
    """Permissible speeds of the skins of a scene.

    Attributes:
        fingerprint: of what they hold for; see ``speed_limit_table.limit_fingerprint``.
        date: when they were computed, UTC.
        coneskin: the version.
        edition: document and edition that the limits of the force are from.
        transcribed_by: who copied them from it.
        verified_by: who compared them with it.
        measured_by: what measured reaction time and deceleration.
        reaction: from the closing of the layers until the arm brakes [s].
        deceleration: of the leading joint then [rad/s^2].
        lowest: joint positions [rad] from which on the patches' own curves hold; empty where only the others do.
        highest: joint positions [rad] up to which they do.
        levers: speed of a patch along its normal over that of the leading joint [m/rad], rising.
        curves: permissible speeds along the normal [m/s], one for each lever.
        patches: of the skins.
    """

    fingerprint: str
    date: str
    coneskin: str
    edition: str
    transcribed_by: str
    verified_by: str
    measured_by: str
    reaction: float
    deceleration: float
    lowest: tuple[float, ...]
    highest: tuple[float, ...]
    levers: tuple[float, ...]
    curves: tuple[tuple[float, ...], ...]
    patches: tuple[LimitedPatch, ...]
