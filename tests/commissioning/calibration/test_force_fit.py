"""Tables of forces: what known presses give and are worth elsewhere; what a scene and an event make of them."""

import math
import re

import pytest

from coneskin.commissioning.calibration.calibrate import _calibration_marks
from coneskin.commissioning.calibration.touches import ForceSequence, SensorPresses, _KnownPress, fit_forces
from coneskin.commissioning.touching import Touching
from coneskin.core.errors import SceneError, SensorError, SkinError
from coneskin.robot.guard.signals.contact import Contact, GuardedSensor
from coneskin.scene.reader import parse_scene
from coneskin.skin.calibration import ForceTable
from coneskin.skin.detection.frame.reading import TouchReading
from tests.support.scenes import forearm_scene

FORCES = (1.0, 2.0, 5.0, 10.0)
TABLE = "forces_n = [1, 2, 5, 10]\nforce_levels = [0.3, 0.5, 0.7, 0.8]\nforce_error = 0.12\n"


def level(force: float, gain: float = 1.0) -> float:
    """Conductance goes with force^0.8."""
    strength = 0.5 * gain * force**0.8
    return strength / (1.0 + strength)


def presses(gains: tuple[float, ...] = (1.0, 1.0, 1.0)) -> list[_KnownPress]:
    return [_KnownPress(force, place, level(force, gain)) for place, gain in enumerate(gains) for force in FORCES]


@pytest.mark.parametrize("force", [1.0, 1.4, 3.0, 7.0, 10.0])
def test_a_power_law_is_read_exactly(force: float) -> None:
    table = fit_forces(presses())
    read, deviation = table.force(min(level(force), table.levels[-1])) or (0.0, 0.0)
    assert read == pytest.approx(force, rel=1e-3)
    assert deviation == pytest.approx(0.02 * force, rel=1e-2)  # the least that is claimed
    assert table.level(force) == pytest.approx(level(force), abs=1e-4)


def test_what_differs_from_place_to_place_is_the_error() -> None:
    """The law: a gain of the conductance of +-10 % is one of the force of +-10 %/0.8."""
    table = fit_forces(presses((0.9, 1.0, 1.1)))
    assert 0.08 < table.error < 0.2
    for gain in (0.9, 1.1):
        read = table.force(level(3.0, gain))
        assert read is not None
        assert abs(read[0] - 3.0) < 2.0 * read[1]


def test_forces_that_the_level_does_not_tell_are_refused() -> None:
    flat = [_KnownPress(20.0, place, level(10.0, gain) + 0.001) for place, gain in enumerate((0.9, 1.0, 1.1))]
    with pytest.raises(SkinError, match="leave out the forces from 20 N on"):
        fit_forces(presses((0.9, 1.0, 1.1)) + flat)


def test_beyond_the_known_forces_nothing_is_said() -> None:
    table = ForceTable((1.0, 10.0), (0.3, 0.8), 0.1)
    assert table.force(0.29) is None
    assert table.force(0.81) is None
    with pytest.raises(SensorError, match=re.escape("1 to 10 N, got 0.5 N")):
        table.level(0.5)


@pytest.mark.parametrize(
    ("forces", "levels"),
    [((1.0,), (0.3,)), ((1.0, 2.0), (0.4, 0.3)), ((2.0, 1.0), (0.3, 0.4)), ((1.0, 2.0), (0.3, 1.0))],
)
def test_no_table_that_does_not_rise(forces: tuple[float, ...], levels: tuple[float, ...]) -> None:
    with pytest.raises(SensorError):
        ForceTable(forces, levels, 0.1)


def test_a_scene_may_give_the_threshold_in_newtons() -> None:
    text = forearm_scene()
    given = text.replace("radius1_mm", f"{TABLE}touch_force_n = 1\nradius1_mm", 1)
    sensor = parse_scene(given).sensors[0].sensor
    assert sensor.thresholds.location_level == sensor.thresholds.touch_level
    assert sensor.thresholds.touch_level == pytest.approx(0.3)
    for keys, said in (
        ("touch_force_n = 2\n", "needs a calibration with known forces: coneskin calibrate SCENE --forces"),
        (f"{TABLE}touch_force_n = 0.5\n", "1 to 10 N, got 0.5 N"),
        (f"{TABLE}touch_force_n = 2\ntouch_level = 0.1\n", "leave one out"),
    ):
        with pytest.raises(SceneError, match=said):
            parse_scene(text.replace("radius1_mm", f"{keys}radius1_mm", 1))


def test_an_event_has_the_force_with_its_deviation() -> None:
    table = ForceTable((1.0, 10.0), (0.3, 0.8), 0.1)
    where = GuardedSensor("one", "forearm", 3, lambda u, phi: ((u, phi, 0.0), (0.0, 0.0, 1.0)), force=table.force)
    known = Contact(TouchReading(0.0, 0.8, 0.1, 1.0, True, "", 0, 0), where, 1).details()
    assert known["force"] == pytest.approx((10.0, 1.0))
    lighter = Contact(TouchReading(0.0, 0.2, 0.1, 1.0, True, "", 0, 0), where, 1).details()
    assert lighter["force"] is None


def test_each_mark_is_pressed_with_each_force_until_the_level_rests() -> None:
    sensor = parse_scene(forearm_scene()).sensors[0].sensor
    item = SensorPresses(sensor, _calibration_marks(sensor)[:2])
    sequence, now, said = ForceSequence([item], (5.0, 1.0)), 0.0, []
    touching, pressed = Touching(sequence), 0.0
    while not sequence.over and now < 60.0:
        now += 0.01
        if sequence.mark is None:
            pressed, reading = 0.0, None
        else:
            pressed += 0.01
            rising = level(sequence.force) * (1.0 - 0.5 * math.exp(-pressed / 0.3))  # it creeps
            reading = TouchReading(now, rising, 0.1, 1.0, True, "", 0, 0)
        said += touching.update(now, {sensor.name: reading})
    assert [(press.place, press.force) for press in item.presses] == [(0, 1.0), (0, 5.0), (1, 1.0), (1, 5.0)]
    assert [press.level for press in item.presses] == pytest.approx([level(1.0), level(5.0)] * 2, abs=0.004)
    assert said[0].text.startswith(f"1 of 4: press {sensor.name} with 1 N (the weight of 102 g), ")
    assert sequence.refuse()[0].kind == "failed"
    assert "without --forces" in sequence.incomplete
