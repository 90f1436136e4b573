"""Sheets as they are built: against NGSolve with the same tensor, and in the limits that have a formula."""

import json
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from coneskin.core.errors import SensorError
from coneskin.geometry.frustum import Frustum
from coneskin.skin.sensor import Sensor
from coneskin.skin.tolerance import COATED_SHEETS, FILM_SHEETS, PlaceFloor, SheetTolerance
from coneskin.skin.virtual.built_sheets import _BuiltSheet, _BuiltSheets, _draw_flaws, _SheetFlaws, build_specimen
from coneskin.skin.virtual.circuit import LayerContact
from coneskin.skin.virtual.field_contacts import FieldContacts
from coneskin.skin.wire import FrameDecoder

SENSOR = Sensor(Frustum(0.0375, 0.0375, 0.24, math.radians(350.0)))
CONTACT = LayerContact(0.06, 1.0, 1e-3, 0.004, 0.004)
IDEAL = _SheetFlaws()


def centre(matrix) -> tuple[float, float]:
    """Electrical centre of a contact, from the current that each electrode takes of a small one."""
    a, b, c, d = (-(row[2] + row[3]) if k < 2 else -(row[0] + row[1]) for k, row in enumerate(matrix))
    return a / (a + b), c / (c + d)


def test_ideal_sheets_are_the_exact_field() -> None:
    exact = np.array(FieldContacts().admittances(SENSOR, [[CONTACT]])[0])
    built = np.array(_BuiltSheets((IDEAL, IDEAL), FieldContacts()).admittances(SENSOR, [[CONTACT]])[0])
    assert built == pytest.approx(exact, abs=1e-15)


def test_a_slope_moves_the_potential_by_its_integral() -> None:
    """f(x) = x + s (x^2 - x)/2 of a resistance 1 + s (x - 1/2)."""
    flaws = (_SheetFlaws(slope=0.1), IDEAL)
    (matrix,) = _BuiltSheets(flaws, FieldContacts()).admittances(SENSOR, [[CONTACT]])
    (ideal,) = FieldContacts().admittances(SENSOR, [[CONTACT]])
    x = CONTACT.u / SENSOR.frustum.slant
    moved = centre(matrix)[0] - centre(ideal)[0]
    assert moved == pytest.approx(0.05 * (x * x - x), rel=0.02)
    assert centre(matrix)[1] == pytest.approx(centre(ideal)[1], abs=1e-4)


def test_a_line_fed_at_one_end_has_the_resistance_of_its_ladder() -> None:
    """An electrode of r ohm whose current leaves evenly is r/3 in series, to first order."""
    bare = np.array(_BuiltSheets((_SheetFlaws(lines=(3.0, 0.0)), IDEAL), FieldContacts()).admittances(SENSOR, [[]])[0])
    ideal = np.array(FieldContacts().admittances(SENSOR, [[]])[0])
    assert 1.0 / bare[0, 0] - 1.0 / ideal[0, 0] == pytest.approx(1.0, rel=0.02)
    currents = np.kron(np.diag([bare[0, 0], ideal[2, 2]]), [[1.0, -1.0], [-1.0, 1.0]])
    # what enters at A leaves at B, and the lower sheet feels nothing; 1e-8 is the rounding of a line of 0.1 mohm
    assert bare == pytest.approx(currents, abs=1e-7)


def test_what_peels_off_narrows_the_way_of_the_current() -> None:
    bare = np.array(_BuiltSheets((_SheetFlaws(peeled=0.2), IDEAL), FieldContacts()).admittances(SENSOR, [[]])[0])
    ideal = np.array(FieldContacts().admittances(SENSOR, [[]])[0])
    assert 0.9 * ideal[0, 0] < bare[0, 0] < 0.999 * ideal[0, 0]


def test_the_floor_holds_a_fifth_of_an_electrode_that_no_reading_shows_to_have_peeled_off() -> None:
    size, x = (0.24, 0.229), np.arange(49) / 48
    off = size[0] * (_BuiltSheet(_SheetFlaws(peeled=0.2), size, 1000.0).answer[:2401, 1].reshape(49, 49) - x[:, None])
    for tolerance, held in ((FILM_SHEETS, True), (replace(FILM_SHEETS, peel=0.0), False)):
        floor = PlaceFloor(tolerance, size, (1048.0, 954.0))
        variances = np.array([[floor.at(a, b, 0.0, 0.0)[0] for b in x] for a in x])
        assert bool(np.mean(off**2 < 3.84 * variances) > 0.93) is held


@pytest.mark.long
@pytest.mark.parametrize("flaw", ["line", "skew"])
def test_the_ellipse_of_the_floor_holds_19_of_20_places_of_sheets_drawn_from_their_class(flaw: str) -> None:
    """By the potentials of both sheets alone; the floor is asked where a touch seems to be. Either end is fed."""
    size, rng, held = (0.24, 0.229), np.random.default_rng(5), []
    floor = PlaceFloor(
        SheetTolerance(**{flaw: 20.0 if flaw == "line" else 0.05, "reading": 1e-6}), size, (1048.0, 954.0)
    )
    part = np.linspace(0.1, 0.9, 17)
    x, y = (part * side for side in size)

    def seen(along: tuple[float, float]) -> np.ndarray:
        """Where a sheet puts what lies on a grid, along its own side [m]."""
        flaws = _SheetFlaws(lines=tuple(abs(rng.normal(0.0, 20.0, 2))))
        flaws = flaws if flaw == "line" else _SheetFlaws(skew=rng.normal(0.0, 0.05))
        field = _BuiltSheet(flaws, along, 1000.0).answer[:2401, 1].reshape(49, 49)
        field = field[:, ::-1] if rng.random() < 0.5 and flaw == "line" else field
        return along[0] * RegularGridInterpolator((np.linspace(0.0, 1.0, 49),) * 2, field)(grid)

    grid = np.stack(np.meshgrid(part, part, indexing="ij"), axis=-1)
    for _ in range(60):
        at_x, at_y = seen(size), seen(size[::-1]).T
        for i, j in np.ndindex(at_x.shape):
            xx, xy, yy = floor.at(at_x[i, j] / size[0], at_y[i, j] / size[1], 0.0, 0.0)
            dx, dy = at_x[i, j] - x[i], at_y[i, j] - y[j]
            held.append((yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy) < 5.991)
    assert 0.93 < np.mean(held) < 0.98


@pytest.mark.parametrize("ohms", [0.5, 3.0, 1000.0])
def test_aslant_current_moves_no_place_by_more_than_at_an_edge(ohms: float) -> None:
    """Half of the skew at most, by the sum of 4/(n pi)^2, also where leads of some ohms leave a place unknown."""
    size = (0.24, 0.229)
    skewed, straight = (PlaceFloor(replace(COATED_SHEETS, skew=s), size, (ohms, ohms)) for s in (0.03, 0.0))
    for place in np.ndindex(9, 9):
        x, y = (number / 8.0 for number in place)
        more = np.subtract(skewed.at(x, y, 0.0, 0.0), straight.at(x, y, 0.0, 0.0))
        assert 0.0 <= more[0] <= (0.5 * 0.03 * size[0]) ** 2
        assert 0.0 <= more[2] <= (0.5 * 0.03 * size[1]) ** 2


def test_a_tolerance_leaves_a_part_of_each_electrode_bonded() -> None:
    with pytest.raises(SensorError, match="peel must be less than the whole electrode, 1, got 1"):
        SheetTolerance(peel=1.5)


@pytest.mark.parametrize(("size", "at", "number"), [((0.1, 1.0), (0.5, 1.0), 0), ((1.0, 0.1), (1.0, 0.5), 2)])
def test_a_current_that_runs_aslant_is_turned_back_at_the_edges(size, at, number) -> None:
    """At the edge of a wide sheet, half-way, Catalan's constant by 4/pi^2, of which two terms lack 3 %."""
    floor = PlaceFloor(SheetTolerance(skew=0.02), size, (1000.0, 1000.0))
    moved = 0.02 * 0.1 * 4.0 / math.pi**2 * 0.915966
    assert math.sqrt(floor.at(*at, 0.0, 0.0)[number]) == pytest.approx(moved, rel=0.04)
    assert floor.at(0.5, 0.5, 0.0, 0.0)[number] == 0.0


@pytest.mark.parametrize(("slope", "across", "skew", "stretch"), [(0.2, 0.1, 0.05, 0.1), (-0.3, 0.0, -0.1, 0.0)])
def test_the_field_of_a_sheet_is_that_of_ngsolve(slope: float, across: float, skew: float, stretch: float) -> None:
    ngsolve = pytest.importorskip("ngsolve")
    from netgen.occ import OCCGeometry, WorkPlane

    length, breadth = 0.24, 0.229
    face = WorkPlane().Rectangle(length, breadth).Face()
    for edge in face.edges:
        edge.name = "B" if edge.center.x < 1e-9 else "A" if edge.center.x > length - 1e-9 else "rim"
    mesh = ngsolve.Mesh(OCCGeometry(face, dim=2).GenerateMesh(maxh=0.04))
    space = ngsolve.H1(mesh, order=6, dirichlet="A|B")
    u, v = space.TnT()
    resistance = 1.0 + slope * (ngsolve.x / length - 0.5) + across * (ngsolve.y / breadth - 0.5)
    tensor = ngsolve.CF((1.0, skew, skew, 1.0 + stretch), dims=(2, 2)) / (1000.0 * resistance)
    form = ngsolve.BilinearForm(tensor * ngsolve.grad(u) * ngsolve.grad(v) * ngsolve.dx).Assemble()
    field = ngsolve.GridFunction(space)
    field.Set(mesh.BoundaryCF({"B": 1.0}, 0.0), ngsolve.BND)
    rest = (-form.mat * field.vec).Evaluate()
    field.vec.data += form.mat.Inverse(space.FreeDofs()) * rest
    energy = ngsolve.Integrate(tensor * ngsolve.grad(field) * ngsolve.grad(field), mesh)
    own = _BuiltSheet(_SheetFlaws(slope, across, 0.0, skew, stretch), (length, breadth), 1000.0)
    assert own.own[0, 0] == pytest.approx(energy, rel=1e-3)  # the bond of an electrode is 5 mohm of a kilohm
    for i, j in ((12, 12), (24, 40), (40, 6)):
        seen = own.answer[i * 49 + j, 0]
        assert seen == pytest.approx(field(mesh(length * i / 48, breadth * j / 48)), abs=1e-4)


def test_a_specimen_is_drawn_by_its_seed() -> None:
    assert _draw_flaws(COATED_SHEETS, 3) == _draw_flaws(COATED_SHEETS, 3)
    assert _draw_flaws(COATED_SHEETS, 3) != _draw_flaws(COATED_SHEETS, 4)
    (built,), _ = build_specimen([SENSOR], SheetTolerance(lead=5.0), 1, "ladder", 0.0)
    assert all(ohms > 1.0 for ohms in built.electronics.lead_ohms)


@pytest.mark.long
def test_the_command_sends_a_specimen(tmp_path) -> None:
    def run(*options: str) -> bytes:
        out = tmp_path / "out.bin"
        command = ["sim-skin", "--duration-s", "0.2", "--output", str(out), "--touch", "0.05:0.2:200:90", *options]
        done = subprocess.run([sys.executable, "-m", "coneskin", *command, "--json"], capture_output=True, timeout=100)
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout.splitlines()[-1])["bytes"] == out.stat().st_size
        return out.read_bytes()

    frames = [FrameDecoder().feed(run(*options))[-1] for options in ((), ("--flaw", "slope=0.2", "--flaw", "lead=5"))]
    assert abs(frames[0].radial_c - frames[1].radial_c) > 20
