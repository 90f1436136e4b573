"""Loads: any four terminals against the matrix Y, and the limits of good and bad electronics."""

from __future__ import annotations

import itertools
import math

import mpmath as mp
import numpy as np
import pytest

from coneskin.core.errors import FieldError
from coneskin.skin.field.disc import Disc
from coneskin.skin.field.fourport import Coupling, DrivePhase, Terminal, angular_phase, radial_phase
from coneskin.skin.field.model import FieldModel
from tests.support.field.exact_circuit import exact_volts

from ..field_cases import PAPER

MODEL = FieldModel(PAPER, 100.0, 300.0)


def touch_phase(supply: float = 1.0, pull_down: float = 1e5, lead: float = 0.0, source: float = 0.0) -> DrivePhase:
    """A and B at the supply [V], C and D each pulled down through a resistor [ohm] and read."""
    drive, guide = Terminal(supply, source, lead), Terminal(0.0, pull_down, lead)
    return DrivePhase("touch", drive, drive, guide, guide)


PLACES = (np.array([0.02, 0.05, 0.08]), np.array([0.3, 0.9, 1.2]))


def test_any_terminals_obey_the_admittance() -> None:
    coupling = MODEL.contacts(*PLACES, 0.008, [10.0, 1e3, math.inf])
    phase = DrivePhase(
        "odd", Terminal(1.0, 50.0, 2.0), Terminal(0.2, 1e6, 3.0), Terminal(-0.5, 0.0, 7.0), Terminal(0.0, 1e3)
    )
    read = MODEL.read(coupling, phase)
    y = MODEL.admittance(coupling)
    assert np.allclose(np.einsum("nij,nj->ni", y, read.electrodes), read.currents, rtol=1e-10, atol=1e-13)
    for e, t in enumerate(phase.terminals):
        assert np.allclose(read.electrodes[:, e], t.emf - (t.resistance + t.lead) * read.currents[:, e], atol=1e-9)
        assert np.allclose(read.terminals[:, e] - read.electrodes[:, e], t.lead * read.currents[:, e], atol=1e-12)
    assert np.abs(read.currents.sum(axis=1)).max() < 1e-17
    assert np.allclose(read.contact, read.currents[:, :2].sum(axis=1), rtol=1e-12)


@pytest.mark.parametrize("phase", [radial_phase, angular_phase])
def test_electronics_tend_to_the_ideal(phase) -> None:
    coupling = MODEL.contacts(*PLACES, 0.008, [10.0, 1e3, math.inf])
    ideal = MODEL.read(coupling, phase()).terminals
    errors = [np.abs(MODEL.read(coupling, phase(adc=r)).terminals - ideal).max() for r in (1e6, 1e8, 1e10)]
    assert errors[0] > 1e-5
    for before, after in itertools.pairwise(errors):
        assert after == pytest.approx(1e-2 * before, rel=0.02)  # proportional to 1/R
    leads = np.abs(MODEL.read(coupling, phase(lead=1e-6)).electrodes - ideal).max()
    assert 0 < leads < 1e-7
    # The general elimination and the closed form of open guides are two ways to one answer.
    assert np.allclose(MODEL.read(coupling, phase(source=1e-300)).electrodes, ideal, rtol=0, atol=4e-16)


def test_a_contact_too_weak_for_y_still_reads_right() -> None:
    """1e-14 S beside 1e-2 S: in Y it is lost, on open guides it still sets the potential."""
    coupling = MODEL.contacts(0.05, 0.9, 0.008, 1e-10)
    x, y = float(coupling.x[0]), float(coupling.y[0])
    read = MODEL.read(coupling, radial_phase(source=1e-3))
    current = read.currents[0, 1]
    exact = (1.0 - 1e-3 * current) - x * (1.0 - 2e-3 * current)
    assert read.electrodes[0, 2:] == pytest.approx([exact, exact], abs=1e-15)
    assert y == pytest.approx(0.9 / PAPER.wrap, abs=1e-12)


def test_touch_phase_is_a_divider() -> None:
    coupling = MODEL.contacts(0.05, 0.5 * PAPER.wrap, 0.008, 1e3)
    read = MODEL.read(coupling, touch_phase(5.0, 1e4))
    # On the middle line C and D are level, so the sheets and their spreading are all in 1/G, before two pull-downs.
    current = float(read.contact[0])
    assert current == pytest.approx(5.0 / (1.0 / float(coupling.conductance[0]) + 5e3), rel=1e-12)
    assert read.terminals[0, 2:] == pytest.approx([current * 5e3] * 2, rel=1e-12)
    assert MODEL.read(MODEL.contacts(0.05, 0.9, 0.008, 0.0), touch_phase(5.0)).terminals[0, 2:] == pytest.approx([0, 0])


def test_no_discs_is_two_bare_sheets() -> None:
    y = MODEL.admittance(MODEL.discs([Disc(0.05, 0.9, 0.008, 0.0)]))[0]
    upper = math.pi / 2 / (100.0 * math.log(2.0))
    assert y[0, 0] == pytest.approx(upper, rel=1e-14)
    assert (y[:2, 2:] == 0.0).all()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Terminal(math.nan), "emf of a terminal must be finite"),
        (lambda: Terminal(0.0, -1.0), "resistance of a terminal must be 0 or more"),
        (lambda: Terminal(0.0, 1.0, math.inf), "lead of a terminal must be 0 or more and finite"),
        (
            lambda: MODEL.read(MODEL.contacts(0.05, 0.9, 0.008), DrivePhase("none", *[Terminal()] * 4)),
            "phase none: all four electrodes are open",
        ),
    ],
)
def test_bad_electronics_are_refused(make, message) -> None:
    with pytest.raises(FieldError, match=message):
        make()


@pytest.mark.parametrize("resistance", [1e3, 1e16, math.inf])
@pytest.mark.parametrize("conductance", [0.0, 1e-14, 1e3])
@pytest.mark.parametrize("phase", [radial_phase, angular_phase, touch_phase])
@pytest.mark.long
def test_inputs_of_any_resistance_keep_their_digits(phase, conductance: float, resistance: float) -> None:
    """At 1e16 ohm and without contact the elimination was singular."""
    if math.isinf(resistance) and conductance == 0.0:
        pytest.skip("nothing fixes the guides")
    many = (0.01 * conductance, 0.003 * conductance, 0.02 * conductance)
    coupling = Coupling(*(np.array([v]) for v in (conductance, 0.3, 0.6, *many, 0.0)))
    for upper, lower in ((100.0, 100.0), (1e-3, 1e6), (1e6, 0.1)):
        model = FieldModel(PAPER, upper, lower)
        for lead in (0.0, 3.0):
            made = phase(1.0, resistance, lead)
            got = model.read(coupling, made).electrodes[0]
            assert (
                max(abs(float(mp.mpf(v) - e)) for v, e in zip(got, exact_volts(coupling, model, made), strict=True))
                < 2e-15
            )
