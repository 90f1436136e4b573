"""Rules that choose the reaction to a touch: the first whose conditions hold, else the default. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from coneskin.core.errors import RobotRefused

from .types import KINDS, Reaction


@dataclass(frozen=True, slots=True)
class Rule:
    """Reaction with its conditions. A condition that is None always holds; all must hold.

    Attributes:
        reaction: what to do.
        link: index of the touched link's DH frame.
        level_above: the touch is firmer than this.
        speed_above: the leading joint was faster than this when the touch began [rad/s].

    Raises:
        RobotRefused: a condition is not a finite number, or no link of an arm.
    """

    reaction: Reaction
    link: int | None = None
    level_above: float | None = None
    speed_above: float | None = None

    def __post_init__(self) -> None:
        if self.link is not None and self.link < 0:
            raise RobotRefused(f"a rule's link must be 0 (base) or a link beyond it, got {self.link}")
        for name, unit in (("level_above", ""), ("speed_above", " rad/s")):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value >= 0.0):
                raise RobotRefused(f"a rule's {name} must be finite and at least 0{unit}, got {value!r}")

    def fits(self, link: int, level: float, speed: float) -> bool:
        """Tell whether every condition holds.

        Args:
            link: index of the touched link's DH frame.
            level: how firm the touch is.
            speed: of the leading joint when it began [rad/s]; infinite where it is not known.
        """
        return (
            (self.link is None or self.link == link)
            and (self.level_above is None or level > self.level_above)
            and (self.speed_above is None or speed > self.speed_above)
        )


@dataclass(frozen=True, slots=True)
class RuleSet:
    """All rules of a scene, with the default."""

    default: Reaction  #: the reaction to a touch that no rule fits
    rules: tuple[Rule, ...] = ()  #: in the order in which they are tried

    @property
    def kinds(self) -> frozenset[str]:
        """Kinds of reaction that may be chosen."""
        return frozenset(reaction.kind for reaction in (self.default, *(rule.reaction for rule in self.rules)))

    @property
    def move(self) -> bool:
        """True where one of them may move the arm away."""
        return any(reaction.moves for reaction in (self.default, *(rule.reaction for rule in self.rules)))

    def without_motion(self) -> RuleSet:
        """Return these rules with a stop, and its deceleration, where one of them moves the arm away."""
        return RuleSet(
            _still(self.default), tuple(replace(rule, reaction=_still(rule.reaction)) for rule in self.rules)
        )

    def choose(self, link: int, level: float, speed: float) -> Reaction:
        """Return the reaction to one touch; arguments as of ``Rule.fits``."""
        for rule in self.rules:
            if rule.fits(link, level, speed):
                return rule.reaction
        return self.default

    def hardest(self, touches: Iterable[tuple[int, float]], speed: float) -> Reaction:
        """Return the reaction to several touches at once, link and level of each: the least gentle of theirs.

        None at all gives the default. The speed is that of the leading joint when they began [rad/s].
        """
        chosen = [self.choose(link, level, speed) for link, level in touches]
        return max(chosen, key=lambda reaction: KINDS.index(reaction.kind), default=self.default)


def _still(reaction: Reaction) -> Reaction:
    return replace(reaction, kind="stop") if reaction.moves else reaction
