"""docs/understand/conventions.md against the code: what it names exists, and its handedness and signs hold."""

import importlib
import math
import re

import pytest

from coneskin.geometry.frustum import Frustum, unroll
from coneskin.skin.sensor import Sensor
from tests.support.flat_pattern import locate_flat
from tests.support.paths import ROOT

DOCUMENT = (ROOT / "docs" / "understand" / "conventions.md").read_text(encoding="utf-8")
HOMES = {
    "Frustum": "coneskin.geometry.frustum",
    "Sector": "coneskin.geometry.frustum",
    "PlacedFrustum": "coneskin.geometry.placed_frustum",
    "Sensor": "coneskin.skin.sensor",
    "Electronics": "coneskin.skin.electronics",
    "ContactMatrix": "coneskin.skin.detection.frame.contact_matrix",
    "TouchEvent": "coneskin.skin.detection.events",
    "ArmModel": "coneskin.robot.arm.model",
    "ControllerState": "coneskin.robot.ur.rtde_codec",
    "kinematics": "coneskin.robot.arm.kinematics",
}


def test_every_file_exists() -> None:
    files = set(re.findall(r"`((?:geometry|skin|robot)/[\w/]+\.py)`", DOCUMENT))
    assert len(files) >= 5
    assert [name for name in files if not (ROOT / name).is_file()] == []


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`((?:[A-Z]\w+|kinematics)\.\w+)`", DOCUMENT))))
def test_every_attribute_exists(name: str) -> None:
    holder, attribute = name.split(".")
    module = importlib.import_module(HOMES[holder])
    thing = module if holder == "kinematics" else getattr(module, holder)
    assert hasattr(thing, attribute) or attribute in thing.__annotations__


def test_a_symbol_stands_for_one_quantity() -> None:
    table = DOCUMENT.split("## Symbols")[1].split("\n## ")[0]
    symbols = [
        symbol.strip()
        for row in re.findall(r"^\| [^|]+ \| ([^|]+) \| [^|]+ \| [^|]+ \|$", table, re.MULTILINE)[1:]
        for symbol in row.split(",")
        if symbol.strip()  # some quantities have no symbol
    ]
    assert len(symbols) == len(set(symbols)) > 20
    wanted = {"u", "phi", "rho1", "rho2", "h", "s", "a", "r1", "r2", "theta0", "r", "theta", "U0", "Ur", "Utheta"}
    assert wanted | {"R_upper", "q", "qd", "J"} <= set(symbols)


@pytest.mark.parametrize("cone", [Frustum(0.05, 0.05, 0.2), Frustum(0.04, 0.07, 0.15), Frustum(0.07, 0.04, 0.15)])
def test_flat_x_flat_y_and_the_outward_normal_are_right_handed(cone: Frustum) -> None:
    """Move a little along flat x and flat y on the sheet: on the link, their cross product is the normal."""
    u, phi, step = 0.07, 1.2, 1e-6
    x, y = cone.flat_point(u, phi)
    here = cone.point(u, phi)
    along_x = [(b - a) / step for a, b in zip(here, cone.point(*locate_flat(cone, x + step, y)), strict=True)]
    along_y = [(b - a) / step for a, b in zip(here, cone.point(*locate_flat(cone, x, y + step)), strict=True)]
    cross = (
        along_x[1] * along_y[2] - along_x[2] * along_y[1],
        along_x[2] * along_y[0] - along_x[0] * along_y[2],
        along_x[0] * along_y[1] - along_x[1] * along_y[0],
    )
    assert cross == pytest.approx(cone.normal(phi), abs=1e-4)  # curvature 1/rho = 25 per m, times the step


@pytest.mark.parametrize(("cone", "sign"), [(Frustum(0.04, 0.07, 0.15), 1.0), (Frustum(0.07, 0.04, 0.15), -1.0)])
def test_r_follows_u_as_the_document_says(cone: Frustum, sign: float) -> None:
    r, theta = cone.polar(0.06, 1.0)
    sector = unroll(cone)
    assert r == pytest.approx(sector.r1 + sign * 0.06, rel=1e-14)
    assert theta == pytest.approx(sector.theta0 / cone.wrap, rel=1e-14)
    assert math.copysign(1.0, cone.half_angle) == sign


def test_b_is_at_end_1_and_c_at_the_far_edge() -> None:
    sensor = Sensor(Frustum(0.04, 0.07, 0.15))
    assert sensor.fractions(0.0, 0.0) == (1.0, 0.0)  # on B and on D
    radial, angular = sensor.fractions(sensor.frustum.slant, sensor.frustum.wrap)  # on A and on C
    assert radial == pytest.approx(0.0, abs=1e-15)
    assert angular == 1.0
