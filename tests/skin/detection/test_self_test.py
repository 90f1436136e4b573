"""Self-test of the frames of a touch: an input with a wrong gain is a fault, a contact never is."""

import math
import random

import pytest

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.detector import Detector
from coneskin.skin.detection.events import SkinFault, TouchBegan
from coneskin.skin.detection.frame.contact_matrix import FrameInversion
from coneskin.skin.detection.frame.faults import Fault
from coneskin.skin.detection.frame.untouched import UntouchedCurrents
from coneskin.skin.detection.self_test import FrameSelfTest
from coneskin.skin.electronics import Electronics
from coneskin.skin.field.model import FieldModel
from coneskin.skin.field.sheet import SectorSheet
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import measure
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import Frame, FrameDecoder

FOREARM = Frustum(0.0375, 0.0375, 0.24, math.radians(350))
#: electrode -> the readings of its input
READINGS = {
    "A": ("angular_a",),
    "B": ("angular_b",),
    "C": ("touch_c", "radial_c"),
    "D": ("touch_d", "radial_d"),
}
TOUCH = ScriptedTouch(0.07, 0.4, 0.15, 2.0, force=20.0)


def play(touches, spoil=None, bits=12):
    """Events of a virtual skin whose frames are spoilt on their way."""
    sensor = Sensor(FOREARM, electronics=Electronics(adc_bits=bits, current_full_scale=0.0058))
    skin = VirtualSkin([sensor], touches, model="ladder", duration=0.25)
    detector, frames, events = Detector(sensor), FrameDecoder(), []
    for time, data in skin.packets():
        for frame in frames.feed(data):
            events += detector.feed(spoil(frame, time) if spoil else frame, time)
    return events


def gain(electrode, ratio, begins=0.0):
    names = READINGS[electrode]
    return lambda frame, time: (
        frame._replace(**{name: round(getattr(frame, name) * ratio) for name in names}) if time >= begins else frame
    )


@pytest.mark.parametrize("begins", [0.0, 0.13])
@pytest.mark.parametrize("electrode", READINGS)
def test_an_input_whose_gain_is_off_is_a_fault(electrode, begins):
    """By 5 %. By 3 % a place that was called certain could be off by 5 mm, and nothing said so."""
    events = play([TOUCH], gain(electrode, 0.95, begins))
    began = next(event for event in events if isinstance(event, TouchBegan))
    faults = [event for event in events if isinstance(event, SkinFault)]
    assert [event.fault for event in faults] == [Fault.GUIDES_DISAGREE]
    assert 0.0 <= faults[0].time - max(began.time, begins) < 0.08


@pytest.mark.parametrize("ratio", [0.905, 1.095])
def test_a_drive_current_that_is_read_wrongly_from_the_start_is_a_fault(ratio):
    """Its sheets look like others; but what it draws in the touch phase is not what the pull-downs carry."""
    names = ("touch_current", "radial_current", "angular_current")
    events = play([TOUCH], lambda frame, _: frame._replace(**{n: round(ratio * getattr(frame, n)) for n in names}))
    assert [event.fault for event in events if isinstance(event, SkinFault)] == [Fault.GUIDES_DISAGREE]


@pytest.mark.parametrize("bits", [10, 16])
def test_touches_of_every_kind_are_none(bits):
    rng = random.Random(3)
    touches = [
        ScriptedTouch(
            0.07 + 0.02 * n, 0.14 + 0.02 * n, rng.uniform(0.01, 0.23), rng.uniform(0.1, 6.0),
            force=rng.uniform(1.0, 50.0), rise=rng.choice((0.002, 0.05)),
        )
        for n in range(6)
    ]  # fmt: skip
    assert not [event for event in play(touches, bits=bits) if isinstance(event, SkinFault)]


@pytest.mark.parametrize(("contacts", "speed", "growth"), [(1, 1.0, 0.0), (2, 0.3, 0.0), (2, 0.0, 0.1)])
def test_a_contact_that_moves_or_grows_between_the_phases_is_none(contacts, speed, growth):
    """At 1 m/s, or by 10 % in a ms; exact field, without noise."""
    rng = random.Random(contacts)
    sensor, sheet = Sensor(FOREARM), SectorSheet.of_frustum(FOREARM)
    parts = sensor.electronics
    model = FieldModel(sheet, sensor.upper_sheet_ohms, sensor.lower_sheet_ohms, 1e-7)
    inversion, tested = FrameInversion(sensor), FrameSelfTest(sensor, UntouchedCurrents(sensor, 0.0))
    volt, ampere = parts.full_count / parts.adc_volts, parts.full_count / parts.current_full_scale
    for _ in range(20):
        u, phi, turn = rng.uniform(0.03, 0.1), rng.uniform(0.5, 2.5), rng.uniform(0.0, 2.0 * math.pi)
        phases = []
        for phase in (0, 1, 2):
            way = speed * phase / 3000.0
            us = [u + way * math.cos(turn), u + 0.09][:contacts]
            phis = [phi + way * math.sin(turn) / FOREARM.radius1, phi + 2.0][:contacts]
            conductances = [2e4 * (1.0 + growth * phase / 3.0), 2e4][:contacts]
            phases.append(model.admittance(model.contacts([us], [phis], 0.006, [conductances])).tolist()[0])
        counts = {
            name: v * (ampere if name.endswith("current") else volt)
            for name, v in measure(sensor, phases)._asdict().items()
        }
        matrix = inversion.invert([counts[name] for name in Frame._fields[6:-1]])
        assert matrix is not None
        assert tested.deviation(matrix) < 0.3
