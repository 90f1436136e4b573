"""Every error that coneskin raises.

ConeSkinError
├── GeometryError (ValueError)            a shape that cannot be: negative radius, wrap above a full turn
├── MeshError (ValueError)                a mesh that cannot be read or used
├── SceneError (ValueError)               a scene file with mistakes; ``problems`` lists them all
├── MissingExtra (ImportError)            a package that this job needs is not installed
├── SkinError
│   ├── SensorError (ValueError)          a sensor that cannot be: no supply, an ADC of no bits
│   ├── FieldError (ValueError)           a field problem that cannot be: overlapping contacts, negative resistance
│   ├── SkinConnectionError (ConnectionError)   the port cannot be opened, or is gone
│   └── SkinTimeout (TimeoutError)        no bytes within the time allowed
├── RobotError
│   ├── KinematicsError (ValueError)      an unknown arm or link, an unreachable pose
│   ├── RobotConnectionError (ConnectionError)  the controller cannot be reached, or is gone
│   ├── RobotTimeout (TimeoutError)       the controller does not answer, or the arm does not stop in time
│   ├── RobotRefused (RuntimeError)       the controller, or the guard, refuses to start or to go on
│   └── Collision (RuntimeError)          the skin was touched and the arm has reacted
└── RecordingError (ValueError)           a recording that cannot be read

A leaf is also the builtin named behind it, so ``except ValueError`` works in code that does not know coneskin.
Mistakes in calling (a wrong type) stay TypeError.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any


class ConeSkinError(Exception):
    """The root of the tree: catch it to catch everything that coneskin raises on purpose."""


class GeometryError(ConeSkinError, ValueError):
    """A shape that cannot be."""


class MeshError(ConeSkinError, ValueError):
    """A mesh that cannot be read, or that has no use as a link."""


class SceneError(ConeSkinError, ValueError):
    """A scene file with mistakes, all of them.

    Attributes:
        problems: one line for each mistake: key, rule, unit and value.
    """

    def __init__(self, problems: Sequence[str], source: str = "scene") -> None:
        self.problems = tuple(problems)
        count = f"{len(self.problems)} mistake" + ("s" if len(self.problems) != 1 else "")
        super().__init__("\n".join([f"{source}: {count}", *(f"  {line}" for line in self.problems)]))
        self._source = source

    def __reduce__(self) -> tuple[type[SceneError], tuple[tuple[str, ...], str]]:
        return type(self), (self.problems, self._source)


class MissingExtra(ConeSkinError, ImportError):
    """A package that this job needs is not installed."""

    def __init__(self, package: str, job: str, extra: str | None = None, remedy: str = "") -> None:
        self.package = package
        target = f"'coneskin[{extra}]'" if extra else package
        super().__init__(f"{job} needs the package {package}: {remedy or f'pip install {target}'}")
        self._made_of = (package, job, extra, remedy)

    def __reduce__(self) -> tuple[type[MissingExtra], tuple[str, str, str | None, str]]:
        return type(self), self._made_of


@contextmanager
def needed_package(package: str, job: str, extra: str | None = None) -> Iterator[None]:
    """Let an ImportError in the ``with`` become a ``MissingExtra`` of these arguments."""
    try:
        yield
    except ImportError as exc:
        raise MissingExtra(package, job, extra) from exc


class SkinError(ConeSkinError):
    """Something is wrong with the skin."""


class SensorError(SkinError, ValueError):
    """A sensor that cannot be."""


class FieldError(SkinError, ValueError):
    """A field problem that cannot be."""


class SkinConnectionError(SkinError, ConnectionError):
    """The port of the skin cannot be opened, or is gone."""


class SkinTimeout(SkinError, TimeoutError):
    """The skin sent nothing within the time allowed."""


class RobotError(ConeSkinError):
    """Something is wrong with the arm or its controller."""


class KinematicsError(RobotError, ValueError):
    """An unknown arm or link, or a pose that it cannot reach."""


class RobotConnectionError(RobotError, ConnectionError):
    """The controller cannot be reached, or is gone."""


class RobotTimeout(RobotError, TimeoutError):
    """The controller does not answer, or the arm does not stop, within the time allowed."""


class RobotRefused(RobotError, RuntimeError):
    """The controller, or the guard, refuses to start or to go on."""


class Collision(RobotError, RuntimeError):
    """The skin was touched and the arm has reacted.

    Attributes:
        sensor: name of the touched sensor.
        link: name of the link that carries it.
        u: slant distance of the touch from end 1 of the sensor [m].
        phi: its azimuth [rad].
        point: its place in the DH frame of the link [m].
        normal: outward unit normal of the skin there, in that frame.
        level: how firm it is, in the detector's unit.
        location_valid: True where the place is certain.
        time: when it was seen, on the clock of the events [s].
        reaction: what the reaction did, such as "touch; retreat 49.5 mm: the distance is made"; empty where not known.
        standstill_confirmed: True where the arm was measured standing and has not moved since.
        number: of the stop, for ``Session.reset``.
        event: the ``GuardEvent`` that reported it; ``event.details["ellipse"]`` is how far off the place may be.
    """

    def __init__(
        self, message: str, event: Any = None, standstill_confirmed: bool = False, reaction: str = "", number: int = 0
    ) -> None:
        super().__init__(message)
        self.number = number
        details: Mapping[str, Any] = {} if event is None else event.details
        self.sensor: str = details.get("sensor", "")
        self.link: str = details.get("link", "")
        self.u: float = details.get("u", math.nan)
        self.phi: float = details.get("phi", math.nan)
        self.point: tuple[float, ...] = tuple(details.get("point", ()))
        self.normal: tuple[float, ...] = tuple(details.get("normal", ()))
        self.level: float = details.get("level", math.nan)
        self.location_valid: bool = details.get("location_valid", False)
        self.time: float = math.nan if event is None else event.time
        self.standstill_confirmed = standstill_confirmed
        self.reaction = reaction
        self.event = event

    def __repr__(self) -> str:
        place = f"u={1e3 * self.u:.1f} mm, phi={math.degrees(self.phi):.1f} deg, level={self.level:.2f}"
        return (
            f"<Collision {self.number}: {self.sensor!r} on {self.link!r}, {place}, stands={self.standstill_confirmed}>"
        )

    def _repr_html_(self) -> str:
        """Return what a notebook shows: the section of the link with the side that was touched, and the facts."""
        from .text import html_card

        x, y = 40.0 * math.cos(self.phi), -40.0 * math.sin(self.phi)
        dot = "" if math.isnan(x) else f"<circle cx='{x:.1f}' cy='{y:.1f}' r='7' fill='#d646e0'/>"
        edge = "<path d='M40 0H54' stroke='#111827'/><text x='57' y='4' font-size='10'>phi = 0</text>"
        link = "<circle r='40' fill='none' stroke='#0c2c4a' stroke-width='5'/>"
        rows = [
            ("sensor", f"{self.sensor} on {self.link}"),
            ("place", f"u = {1e3 * self.u:.1f} mm, phi = {math.degrees(self.phi):.1f} deg"),
            ("certain", "yes" if self.location_valid else "no"),
            ("level", f"{self.level:.2f}"),
            ("reaction", self.reaction or "not known"),
            ("measured standing", "yes" if self.standstill_confirmed else "no"),
        ]
        drawn = f"<svg viewBox='-55 -55 155 110' style='height:110px'>{link}{edge}{dot}</svg>"
        return html_card(f"collision {self.number}", rows, f"session.reset(stop={self.number})", drawn)


class RecordingError(ConeSkinError, ValueError):
    """A recording that cannot be read."""
