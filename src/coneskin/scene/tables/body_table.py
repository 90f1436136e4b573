"""Reader of the tables [[body]] and [padding] of a scene: what the arm runs into in the physics engine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from coneskin.scene.values.body import BODY_KINDS, BodyScene

from .schema import Key, check

if TYPE_CHECKING:
    from coneskin.skin.materials import Padding

__all__ = ["BODY_KEYS", "PADDING_KEYS", "read_bodies", "read_padding"]

BODY_KEYS = (
    Key("kind", str, choices=tuple(BODY_KINDS)),
    Key("xyz_mm", list, low=-10_000.0, high=10_000.0, length=3),
    Key("direction", list, None, low=-1e3, high=1e3, length=3),
    Key("radius_mm", float, 0.04, low=1.0, high=2000.0),
    Key("length_mm", float, 0.3, low=1.0, high=5000.0),
    Key("mass_kg", float, None, low=0.05, high=1000.0),
    Key("stiffness_n_per_mm", float, None, low=0.1, high=10_000.0),
    Key("damping_ratio", float, 0.3, low=0.0, high=5.0),
    Key("force_n", float, None, low=0.0, high=500.0),
    Key("speed_mm_s", float, 0.25, low=1.0, high=2000.0),
    Key("delay_ms", float, 0.15, low=0.0, high=10_000.0),
)
#: defaults as of ``Padding``
PADDING_KEYS = (
    Key("thickness_mm", float, 6e-3, low=0.1, high=100.0),
    Key("stiffness_n_per_mm", float, 10e3, low=0.1, high=10_000.0),
    Key("hard_n_per_mm", float, 1e6, low=1.0, high=100_000.0),
    Key("loss_s_per_m", float, 0.3, low=0.0, high=10.0),
)
#: keys that a kind must have, because nothing is known that holds for all
_NEEDED = {
    "wall": ("direction",),
    "post": ("direction",),
    "mass": ("mass",),
    "hand": ("mass", "stiffness"),
    "person": ("mass", "stiffness", "force"),
    "grip": ("mass", "stiffness", "force", "direction"),
}


def read_bodies(tables: Mapping[str, Any], problems: list[str]) -> tuple[BodyScene, ...]:
    """Return the bodies of a scene; one with a mistake is left out.

    Args:
        tables: of the whole file.
        problems: every mistake is added here.
    """
    rows = check({"body": tables.get("body", [])}, (Key("body", dict, ()),), "scene", problems)["body"]
    found = [_body(row, f"body {number}", problems) for number, row in enumerate(rows, 1)]
    return tuple(body for body in found if body is not None)


def _body(row: Mapping[str, Any], where: str, problems: list[str]) -> BodyScene | None:
    before = len(problems)
    values = check(row, BODY_KEYS, where, problems)
    kind = values.get("kind", "")
    names = {key.plain: key.name for key in BODY_KEYS}
    for name in _NEEDED.get(kind, ()):
        if values[name] is None:
            problems.append(f"{where}: a {kind} needs {names[name]}; there is no value that holds for every {kind}")
    if values["direction"] is not None and not any(values["direction"]):
        problems.append(f"{where}.direction must not be 0, 0, 0: it is where the body faces")
    if len(problems) > before:
        return None
    values["place"] = values.pop("xyz")
    values["damping"] = values.pop("damping_ratio")
    return BodyScene(**{name: value for name, value in values.items() if value is not None})


def read_padding(tables: Mapping[str, Any], problems: list[str]) -> Padding | None:
    """Return the padding of a scene's skins; None where the file names none.

    Args:
        tables: of the whole file.
        problems: every mistake is added here.
    """
    if "padding" not in tables:
        return None
    from coneskin.skin.materials import Padding

    values = check(tables["padding"], PADDING_KEYS, "padding", problems)
    return Padding(values["thickness"], values["stiffness"], values["hard"], values["loss_s_per_m"])
