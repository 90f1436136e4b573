"""Place of one contact and of several, from the exact field: one is certain soon, two that are far apart never are."""

import math
import random
from collections.abc import Sequence
from functools import lru_cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.frame.reading import TouchReading
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.place.single_contact import (
    DANGEROUS_ANGLE,
    frames_until_certain,
    weakest_pair_excluded,
)
from coneskin.skin.electronics import Electronics, LeadOhms, Polarity
from coneskin.skin.sensor import Sensor
from coneskin.skin.tolerance import IDEAL_SHEETS
from coneskin.skin.virtual.circuit import ContactModel, LayerContact, ResistorLadder, measure
from coneskin.skin.virtual.field_contacts import FieldContacts
from coneskin.skin.virtual.imperfections import ContactLaw
from coneskin.skin.wire import Frame
from tests.support.sweep import sweep

FOREARM = Frustum(0.0375, 0.0375, 0.24, math.radians(350))  # UR5e
SHAPES = {
    "forearm": FOREARM,
    "paper": Frustum(0.025, 0.05, math.sqrt(0.1**2 - 0.025**2)),  # its sector, 90 deg, wrapped all around
    "docs": Frustum(0.0605, 0.0605, 0.4, math.radians(300)),
    "cone": Frustum(0.03, 0.09, 0.15),
}
LAW = ContactLaw()
NOISE = 0.7  # counts


@lru_cache(maxsize=1)
def field() -> FieldContacts:
    return FieldContacts()


def pressed(u: float, phi: float, force: float, radius: float = 0.0) -> LayerContact:
    contact = LAW.touch(force, radius)
    return LayerContact(u, phi, contact.siemens, contact.radius, contact.radius)


def readings(
    sensor: Sensor, contacts: Sequence[LayerContact], model: ContactModel, frames: int = 250, seed: int = 0
) -> list[TouchReading]:
    """What the detector says of each frame of a touch that rests, after 200 untouched ones; noise of 0.7 counts."""
    rng, detector, full = random.Random(seed), Detector(sensor), sensor.electronics.full_count
    found = []
    volt, ampere = full / sensor.electronics.adc_volts, full / sensor.electronics.current_full_scale
    count = 0
    for scene, times in (((), 200), (contacts, frames)):
        y = model.admittances(sensor, [scene])[0]
        inputs = measure(sensor, (y, y, y))._asdict()
        values = [x * (ampere if name.endswith("current") else volt) for name, x in inputs.items()]
        for _ in range(times):
            counts = [min(max(round(value + rng.gauss(0.0, NOISE)), 0), full) for value in values]
            detector.feed(Frame(36, 0, 0, 0, count, 1000 * count, *counts[:12]), 1e-3 * count)
            count += 1
            if detector.reading_now is not None:
                found.append(detector.reading_now)
    return found


def off_normal(sensor: Sensor, reading: TouchReading, contact: LayerContact) -> float:
    """Angle between the normals at the place that is read and at a contact [deg]."""
    part = sensor.frustum.sin_half_angle**2
    return math.degrees(math.acos(min(1.0, part + (1.0 - part) * math.cos(reading.phi - contact.phi))))


def wrong(sensor: Sensor, found: Sequence[TouchReading], contacts: Sequence[LayerContact]) -> int:
    """How many frames have a certain place whose normal is more than 20 deg off a contact's."""
    return sum(
        reading.location_valid and max(off_normal(sensor, reading, one) for one in contacts) > 20.0 for reading in found
    )


def single(rng: random.Random, cone: Frustum) -> list[LayerContact]:
    force, face = math.exp(rng.uniform(math.log(2.0), math.log(40.0))), rng.choice((0.0, rng.uniform(3e-3, 15e-3)))
    radius = 1.05 * LAW.touch(force, face).radius
    u = radius + rng.random() * (cone.slant - 2.0 * radius)
    edge = radius / cone.radius_at(u)
    return [pressed(u, edge + rng.random() * (cone.wrap - 2.0 * edge), force, face)]


def pair(kind: str, rng: random.Random, cone: Frustum) -> list[LayerContact]:
    """Two presses of 2 to 40 N each."""
    u, v = (0.013 + rng.random() * (cone.slant - 0.026) for _ in range(2))
    one, two = (math.exp(rng.uniform(math.log(2.0), math.log(40.0))) for _ in range(2))
    phi = 0.4 + rng.random() * (cone.wrap - 0.8)
    opposite = phi + math.pi if phi + math.pi < cone.wrap - 0.35 else max(0.35, phi - math.pi)
    if kind == "over the seam":  # the palm: at equal u, 5 to 60 deg on both sides
        edge = math.radians(rng.uniform(5.0, 60.0))
        return [pressed(u, edge, one), pressed(u, cone.wrap - edge, rng.choice((one, two)))]
    if kind == "grip":
        return [pressed(u, phi, one), pressed(u, opposite, two)]
    if kind == "clamp":
        return [pressed(u, phi, one), pressed(v, opposite, two)]
    apart = rng.uniform(0.04, 0.2) / cone.radius_at(u)  # fingers
    other = phi + apart if phi + apart < cone.wrap - 0.35 else max(0.35, phi - apart)
    return [pressed(u, phi, one), pressed(v, other, two)]


@pytest.mark.long
@pytest.mark.parametrize("shape", SHAPES)
def test_one_contact_is_soon_certain(shape):
    sensor, rng = Sensor(SHAPES[shape]), random.Random(1)
    for seed in range(12):
        contacts = single(rng, sensor.frustum)
        found = readings(sensor, contacts, field(), seed=seed)
        assert found[-1].doubt == ""
        assert off_normal(sensor, found[-1], contacts[0]) < 5.0


@pytest.mark.long
@settings(max_examples=60, deadline=None)
@given(
    shape=st.sampled_from(sorted(SHAPES)),
    along=st.floats(0.0, 1.0),
    around=st.floats(0.0, 1.0),
    radius=st.floats(3e-3, 15e-3),
    force=st.floats(2.0, 40.0),
)
def test_no_single_disc_is_doubted(shape, along, around, radius, force):
    """The law: wherever a disc of up to 15 mm lies, it adds equally in all directions. Sheets are another doubt."""
    sensor = Sensor(SHAPES[shape], tolerance=IDEAL_SHEETS)
    radius = min(radius, 1.1 * DANGEROUS_ANGLE * sensor.frustum.radius1)  # a wider one is as a ring of 20 deg
    u = 1.05 * radius + along * (sensor.frustum.slant - 2.1 * radius)
    edge = 1.05 * radius / sensor.frustum.radius_at(u)
    contact = pressed(u, edge + around * (sensor.frustum.wrap - 2.0 * edge), force, radius)
    found = readings(sensor, [contact], field())
    assert found[-1].doubt == ""
    assert not any(reading.doubt.startswith("the drive currents") for reading in found)


def test_a_certain_place_stays_certain_while_nothing_changes():
    sensor, rng = Sensor(FOREARM), random.Random(4)
    for seed in range(10):
        valid = [reading.location_valid for reading in readings(sensor, single(rng, FOREARM), field(), 400, seed)]
        assert all(valid[valid.index(True) :])


@pytest.mark.promise("P02")
@pytest.mark.parametrize("kind", ["over the seam", "grip", "clamp", "fingers"])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.long
def test_a_certain_place_is_never_far_from_a_contact(shape, kind):
    sensor, rng = Sensor(SHAPES[shape]), random.Random(2)
    for seed in range(6):
        contacts = pair(kind, rng, sensor.frustum)
        found = readings(sensor, contacts, field(), 150, seed)
        assert found  # it is a touch
        assert wrong(sensor, found, contacts) == 0


def round_place(rng: random.Random, cone: Frustum) -> list[LayerContact]:
    """Two to eight presses of any weights evenly round a place, 13 to 100 mm from it; those off the sheet are left."""
    count, turn = rng.choice((2, 3, 4, 4, 5, 6, 8)), rng.uniform(0.0, math.tau)
    distance = math.exp(rng.uniform(math.log(0.013), math.log(0.1)))
    u0, phi0 = rng.uniform(0.2, 0.8) * cone.slant, rng.uniform(0.2, 0.8) * cone.wrap
    force, spread = math.exp(rng.uniform(math.log(0.6), math.log(20.0))), rng.choice((0.0, 0.3, 1.0))
    radius = cone.radius_at(u0)
    contacts: list[LayerContact] = []
    for n in range(count):
        angle = turn + math.tau * n / count
        u, phi = u0 + distance * math.cos(angle), phi0 + distance * math.sin(angle) / radius
        one = pressed(u, phi, max(0.55, force * math.exp(rng.uniform(-spread, spread))))
        edge = one.radius
        on_sheet = edge < u < cone.slant - edge and edge < radius * phi < radius * cone.wrap - edge
        apart = (math.hypot(u - c.u, radius * (phi - c.phi)) - c.radius for c in contacts)
        if on_sheet and all(gap > 1.1 * edge for gap in apart):
            contacts.append(one)
    return contacts


def far(sensor: Sensor, found: Sequence[TouchReading], contacts: Sequence[LayerContact]) -> int:
    """How many frames have a certain place farther than 20 mm or 20 deg from every contact."""
    return sum(
        reading.location_valid
        and all(
            off_normal(sensor, reading, one) > 20.0
            or math.hypot(
                reading.u - one.u, sensor.frustum.radius_at(one.u) * math.remainder(reading.phi - one.phi, math.tau)
            )
            > 0.02
            for one in contacts
        )
        for reading in found
    )


@pytest.mark.promise("P02")
@pytest.mark.parametrize("shape", sweep(SHAPES, short=2))
def test_contacts_round_a_place_are_never_certain_in_their_middle(shape):
    """Four fingers round a place add equally in all directions, as one does: they add more than one disc can."""
    sensor, rng = Sensor(SHAPES[shape]), random.Random(6)
    cases = [contacts for contacts in (round_place(rng, sensor.frustum) for _ in range(24)) if len(contacts) > 2]
    assert len(cases) > 8
    for seed, contacts in enumerate(cases):
        assert far(sensor, readings(sensor, contacts, field(), 150, seed), contacts) == 0


def test_four_light_tips_are_doubted_however_long_they_rest():
    """Tips of .25 mS at 30 mm along and around: their middle was certain in 98 of 100 frames, 46 deg off each."""
    sensor = Sensor(FOREARM)
    around = 0.03 / 0.0375
    tips = [(0.09, 3.0), (0.15, 3.0), (0.12, 3.0 - around), (0.12, 3.0 + around)]
    contacts = [LayerContact(u, phi, 2.5e-4, 0.004, 0.004) for u, phi in tips]
    found = readings(sensor, contacts, field(), 600)
    assert not any(reading.location_valid for reading in found)
    assert (
        found[-1].doubt
        == "the drive currents rise more than by one contact: several round this place, or a very large one"
    )


@pytest.mark.long
@pytest.mark.parametrize(
    ("model", "kind"),
    [
        *((FieldContacts(), kind) for kind in ("over the seam", "grip", "clamp", "fingers")),
        *((ResistorLadder(), kind) for kind in ("clamp", "fingers")),
    ],
    ids=lambda value: value if isinstance(value, str) else type(value).__name__,
)
def test_a_certain_place_is_never_far_from_a_contact_in_many_presses(model, kind):
    """A ladder has no spreading resistance: two hands conduct twice what a sheet lets them, as if at the seam."""
    sensor, rng = Sensor(FOREARM), random.Random(3)
    for seed in range(60):
        contacts = pair(kind, rng, sensor.frustum)
        assert wrong(sensor, readings(sensor, contacts, model, 250, seed), contacts) == 0


@pytest.mark.parametrize("radial", ["A", "B"])
@pytest.mark.parametrize("angular", ["C", "D"])
@pytest.mark.long
def test_every_polarity_tells_one_contact_from_two(radial, angular):
    sensor = Sensor(FOREARM, polarity=Polarity(radial, angular))
    one = [pressed(0.06, 1.0, 20.0, 0.012)]
    assert readings(sensor, one, field())[-1].doubt == ""
    for phi in (1.6, 2.4):  # diagonal pairs along both diagonals show in the split of the guides
        two = [pressed(0.1, 2.0, 20.0), pressed(0.13, phi, 20.0)]
        assert readings(sensor, two, field())[-1].doubt.startswith("the drive currents rise unequally")


@pytest.mark.parametrize("bits", [12, 14, 16])
def test_finer_electronics_are_certain_sooner(bits):
    sensor = Sensor(FOREARM, electronics=Electronics(adc_bits=bits))
    found = readings(sensor, [pressed(0.1, 3.0, 5.0)], field())
    first = next(k for k, reading in enumerate(found) if reading.location_valid)
    assert first <= {12: 60, 14: 8, 16: 2}[bits]
    # the promise beforehand: after so many frames the weakest pair that counts is excluded
    weakest = weakest_pair_excluded(sensor, first + 1 if bits == 12 else 8)
    assert weakest < 2.0 * DetectorSettings().second_contact
    about = frames_until_certain(sensor, DetectorSettings())
    assert about is not None
    assert about / 4 <= first + 1 <= 4 * about


def test_electronics_that_cannot_tell_never_call_a_place_certain():
    sensor = Sensor(FOREARM, electronics=Electronics(adc_bits=9))
    assert weakest_pair_excluded(sensor, 512) > DetectorSettings().second_contact
    assert frames_until_certain(sensor, DetectorSettings()) is None
    found = readings(sensor, [pressed(0.1, 3.0, 5.0)], field(), 600)
    assert not any(reading.location_valid for reading in found)
    assert found[-1].doubt == "the readings are too coarse to exclude a second contact so lightly touched"


def test_the_published_rises_of_the_drive_currents():
    """decode.md: one contact raises both by 1.003 to 1.058, two 60 deg off the seam only the angular one, to 1.29."""
    sensor = Sensor(
        Frustum(0.0605, 0.0605, 0.4, math.radians(300)), electronics=Electronics(lead_ohms=LeadOhms.equal(1e-3))
    )

    def rises(contacts: list[LayerContact]) -> tuple[float, float]:
        still, y = (field().admittances(sensor, [scene])[0] for scene in ((), contacts))
        before, now = measure(sensor, (still, still, still)), measure(sensor, (y, y, y))
        return now.radial_current / before.radial_current, now.angular_current / before.angular_current

    for radius in (0.01, 0.03):
        radial, angular = rises([LayerContact(0.2, 2.5, 10.0, radius, radius)])
        area = math.pi * radius**2 / (0.4 * 0.0605 * math.radians(300))  # a perfect bond covers the sheet: it halves
        assert radial == pytest.approx(1.0 + area, rel=0.003)
        assert angular == pytest.approx(radial, abs=0.003)
    radial, angular = rises([pressed(0.2, 0.1, 20.0), pressed(0.2, math.radians(300) - 0.1, 20.0)])
    assert radial == pytest.approx(1.0, abs=0.01)
    assert angular > 1.2


def test_two_frames_tell_two_contacts_from_one_that_is_large():
    """At 16 bits noise hides nothing: what edges do to a round contact is no sign of two.

    The first frame already says that there may be several; the line on which they lie comes with the second.
    """
    sensor = Sensor(FOREARM, electronics=Electronics(adc_bits=16, current_full_scale=0.0058))
    rng = random.Random(8)
    for number in range(3):
        u = rng.uniform(0.017, FOREARM.slant - 0.017)
        phi = rng.uniform(0.5, FOREARM.wrap - 0.5)
        one = readings(sensor, [LayerContact(u, phi, 1.0, 0.015, 0.015)], field(), 2, number)
        assert one[-1].elongation is None
    two = [LayerContact(0.12 + side * 0.01, 2.0, 2e-3, 0.005, 0.005) for side in (-1.0, 1.0)]
    first, second = readings(sensor, two, field(), 2)
    assert "several contacts" in first.doubt
    half, direction = second.elongation
    assert half == pytest.approx(0.01, rel=0.1)
    assert abs(math.remainder(direction, math.pi)) < 0.1
