"""Plants of the benches against the exact field and the virtual skin's circuit, with which they share no code."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.electronics import Electronics, LeadOhms
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import measure
from tests.support.field.converter_plant import ConverterPlant, leak_admittance
from tests.support.field.flat_plant import FlatPlant, PressedPatch

WRAP = math.radians(350)
#: a forearm; the paper's sector wrapped all around; a cone that narrows
SHEETS = {
    "forearm": (FlatPlant(0.0375, 0.0375, 0.24, WRAP, 1000.0, 1000.0), SectorSheet(0.24, 0.0, 0.0375 * WRAP, WRAP)),
    "paper": (
        FlatPlant(0.025, 0.05, 0.1, 2.0 * math.pi, 1000.0, 1500.0),
        SectorSheet(0.1, 10.0, 0.05 * math.pi, 2.0 * math.pi),
    ),
    "narrowing": (
        FlatPlant(0.05, 0.04, 0.1, 5.0, 800.0, 1000.0),
        SectorSheet(0.1, -2.0, 0.25, 5.0),
    ),
}
SCENES = (
    (PressedPatch.disc(0.05, 1.0, 0.005, 1.0),),
    (PressedPatch.disc(0.03, 2.0, 0.015, math.inf),),
    (PressedPatch.disc(0.06, 3.5, 0.001, 0.3),),
    (PressedPatch.disc(0.02, 1.2, 0.01, 3.0), PressedPatch.disc(0.07, 4.0, 0.006, 0.7)),
)


def exact_admittance(name: str, scene: Sequence[PressedPatch]) -> np.ndarray:
    plant, sheet = SHEETS[name]
    model = FieldModel(sheet, plant.upper, plant.lower)
    columns = [(p.u, p.phi, p.along, plant.conductance(p)) for p in scene]
    u, phi, radius, g = (np.array([column]) for column in zip(*columns, strict=True))
    return model.admittance(model.contacts(u, phi, radius, g))[0]


@pytest.mark.parametrize("name", SHEETS)
def test_discs_agree_with_the_exact_field(name: str) -> None:
    """Degree 5 on some 100 curved triangles: 1e-6 of a conductance moves a place by less than a micrometre."""
    pytest.importorskip("ngsolve", reason="the plant is solved by NGSolve; pip install 'coneskin[bench]'")
    for scene in SCENES:
        ours, theirs = SHEETS[name][0].admittance(scene), exact_admittance(name, scene)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=2e-6 * np.abs(theirs).max())


def test_a_disc_that_an_edge_clips_is_an_ellipse_without_its_half() -> None:
    """A full circle written as an ellipse, and a half of it off the sheet: less conductance, the same on both sides."""
    pytest.importorskip("ngsolve", reason="the plant is solved by NGSolve; pip install 'coneskin[bench]'")
    plant = SHEETS["forearm"][0]
    at_d = plant.admittance([PressedPatch(0.1, 0.0, 0.008, 0.008, 1.0)])
    at_c = plant.admittance([PressedPatch(0.1, WRAP, 0.008, 0.008, 1.0, 0.5)])
    swapped = at_c[np.ix_([0, 1, 3, 2], [0, 1, 3, 2])]
    np.testing.assert_allclose(at_d, swapped, rtol=0, atol=1e-5 * np.abs(at_d).max())


@pytest.mark.parametrize("leak", [0.0, 1e-5])
def test_the_circuit_reads_what_the_virtual_skin_measures(leak: float) -> None:
    electronics = Electronics(lead_ohms=LeadOhms.equal(4.0), adc_bits=16)
    sensor = Sensor(Frustum(0.0375, 0.0375, 0.24, WRAP), electronics=electronics)
    y = exact_admittance("forearm", SCENES[1]) + leak_admittance(leak)
    volts = measure(sensor, [tuple(map(tuple, y.tolist()))] * 3)
    counts = [
        (electronics.count_amperes if name.endswith("current") else electronics.count_volts)(value)
        for name, value in volts._asdict().items()
    ]
    plant = ConverterPlant(bits=16, leads=(4.0,) * 4)
    # half a count of rounding, and a switch of 1 mohm
    np.testing.assert_allclose(plant.exact(y), counts[:10], rtol=0, atol=0.55)


def test_a_supply_that_sags_in_one_phase_shows_there_alone() -> None:
    y = exact_admittance("forearm", SCENES[0])
    steady, sagged = ConverterPlant().exact(y), ConverterPlant(phase_supply=(1.0, 0.99, 1.0)).exact(y)
    np.testing.assert_allclose(sagged[3:6], 0.99 * steady[3:6], rtol=1e-12)
    np.testing.assert_array_equal(sagged[[0, 1, 2, 6, 7, 8, 9]], steady[[0, 1, 2, 6, 7, 8, 9]])


def test_noise_is_drawn_for_each_frame_and_rounded() -> None:
    plant, exact = ConverterPlant(noise=0.7), np.full(10, 1000.25)
    counts = plant.counts(exact, 4000, np.random.default_rng(1))
    assert counts.shape == (4000, 10)
    # the variance of noise and of rounding; 40 000 draws know it to 0.7 %
    assert counts.var() == pytest.approx(0.7**2 + 1.0 / 12.0, rel=0.03)
    assert counts.mean() == pytest.approx(1000.25, abs=0.02)
