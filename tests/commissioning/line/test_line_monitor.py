"""What a monitor reports, from a virtual skin whose script is known; time is an argument."""

import math

import pytest

from coneskin.commissioning.line.line_monitor import (
    LineMonitor,
    LineReport,
    describe_line,
    describe_report,
    draw_screen,
    draw_sheet,
)
from coneskin.core.finding import Finding
from coneskin.geometry.frustum import Frustum
from coneskin.skin.diagnosis.cause import Cause
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin

SENSOR = Sensor(Frustum(0.054, 0.054, 0.434), name="cuff")
TOUCH = ScriptedTouch(0.9, 5.0, u=0.31, phi=1.5, force=8.0)


def heard(skin: VirtualSkin, until: float, sensors: tuple[Sensor, ...] = ()) -> LineReport:
    monitor = LineMonitor(0.0, sensors, 921600)
    for time, data in skin.packets():
        if time > until:
            break
        monitor.feed(data, time)
    return monitor.report(until)


def a_skin(**keys: object) -> VirtualSkin:
    return VirtualSkin(SENSOR, [TOUCH], model="ladder", seed=3, **keys)  # type: ignore[arg-type]


def test_without_a_scene_it_shows_rate_clock_level_and_about_where() -> None:
    report = heard(a_skin(), 1.2)
    assert report.diagnosis.item == Cause.NONE.key, report.diagnosis.line
    (sensor,) = report.sensors
    assert sensor.numbers.rate == pytest.approx(1000.0, rel=0.01)
    assert sensor.numbers.clock_ratio == pytest.approx(1.0, rel=0.001)
    assert (sensor.name, sensor.missing, report.crc_errors, report.skipped) == ("sensor 0/0", 0, 0, 0)
    assert sensor.level > 0.3
    assert sensor.place == pytest.approx((TOUCH.u / 0.434, TOUCH.phi / math.tau), abs=0.03)
    assert not sensor.certain


def test_with_a_scene_it_shows_the_detectors_place_and_what_is_expected() -> None:
    report = heard(a_skin(), 1.6, (SENSOR,))
    (sensor,) = report.sensors
    assert sensor.name == "cuff"
    assert sensor.certain
    assert sensor.words.startswith("u = 3")
    assert "phi = 8" in sensor.words
    assert sensor.expected["radial_current"] == pytest.approx(sensor.counts["radial_current"], rel=0.05)


@pytest.mark.parametrize(("ohms", "said"), [(900.0, "radial current +11 %"), (1100.0, "radial current -9 %")])
def test_layers_that_are_off_the_design_are_remarked(ohms: float, said: str) -> None:
    parts = SENSOR.electronics
    made = Sensor(SENSOR.frustum, electronics=parts, upper_sheet_ohms=ohms, name="cuff")
    report = heard(VirtualSkin(made, model="ladder", seed=3), 0.6, (SENSOR,))
    assert report.diagnosis.verdict == "ok"
    assert said in report.diagnosis.line
    assert "angular current" not in report.diagnosis.line


def test_loss_wrong_checksums_and_a_fast_clock_are_counted() -> None:
    skin = a_skin(faults=FaultInjection(drop_every=50), imperfections=Imperfections(clock_ratio=1.5))
    report = heard(skin, 0.8)
    (sensor,) = report.sensors
    assert sensor.missing == pytest.approx(0.8 * 1000 / 50, abs=2)
    assert report.diagnosis.item == Cause.CLOCK_RATIO.key
    assert sensor.numbers.clock_ratio == pytest.approx(1.5, rel=0.01)


@pytest.mark.parametrize(
    ("begins", "ends", "late"), [(0.4, 9.0, 0.06), (0.3, 0.6, 0.15), (0.6, 9.0, 0.03), (0.0, 0.3, 0.08)]
)
@pytest.mark.parametrize(("ratio", "cause"), [(1.0, Cause.NONE), (1.3, Cause.CLOCK_RATIO), (0.5, Cause.CLOCK_RATIO)])
@pytest.mark.long
def test_a_computer_that_is_held_up_is_not_the_fault_of_the_board(
    begins: float, ends: float, late: float, ratio: float, cause: Cause
) -> None:
    """From one time to another every byte is read late; the clock is blamed where it is wrong, and only there."""
    monitor = LineMonitor(0.0, (), 921600)
    now = 0.0
    for time, data in a_skin(imperfections=Imperfections(clock_ratio=ratio)).packets():
        if time > 0.9:
            break
        now = max(now, time + (late if begins <= time < ends else 0.0))
        monitor.feed(data, now)
    found = monitor.report(now).diagnosis
    assert (found.item == Cause.CLOCK_RATIO.key) == (cause is Cause.CLOCK_RATIO), found.line


@pytest.mark.long
def test_a_computer_that_loses_frames_while_it_is_held_up_is_named() -> None:
    """It reads nothing for half a second, the newest tenth of which the port has kept; twice in two seconds."""

    def named(held: float) -> Finding:
        monitor, now = LineMonitor(0.0, (), 921600), 0.0
        for time, data in a_skin().packets():
            if time > 2.0:
                break
            ends = next((end for end in (0.7, 2.0) if end - held <= time < end), time)
            if not ends - time > 0.1:
                now = max(now, ends)
                monitor.feed(data, now)
        return monitor.report(now).diagnosis

    assert named(0.0).item == Cause.NONE.key
    found = named(0.5)
    assert found.item == Cause.HELD_UP.key
    assert "this computer held" in found.line


def test_a_line_says_the_diagnosis_first_and_an_object_everything() -> None:
    report = heard(a_skin(), 0.5)
    assert describe_line(report).startswith("frames come as they should (device 0, sensor 0: ")
    found = describe_report(report)
    assert found["diagnosis"]["cause"] == "none"
    assert found["good"] is True
    assert found["sensors"][0]["counts"]["radial_current"] == report.sensors[0].counts["radial_current"]
    assert bytes.fromhex(found["sensors"][0]["frame"]) == report.sensors[0].raw


def test_before_the_first_byte_nothing_is_known_and_nothing_fails() -> None:
    report = LineMonitor(10.0).report(11.5)
    assert report.diagnosis.line.startswith("no byte has come for 1.5 s: check power")
    assert draw_screen(report, with_hex=True, columns=80, color=True)
    assert describe_report(report)["bytes_per_s"] is None or report.size == 0


def test_the_screen_begins_with_the_diagnosis_and_marks_what_has_changed() -> None:
    report = heard(a_skin(), 0.5)
    plain = draw_screen(report, with_hex=True, columns=80, color=False)
    assert plain[0] == report.diagnosis.line
    assert not any("\x1b" in line for line in plain)
    marks = "".join(line for line in plain if set(line) <= {" ", "^"})
    assert marks.count("^^") == len(report.sensors[0].raw_changed) > 3
    colored = draw_screen(report, with_hex=True, columns=80, color=True)
    assert sum(line.count("\x1b[7m") for line in colored) >= len(report.sensors[0].raw_changed)


@pytest.mark.parametrize(
    ("place", "row", "column"), [((0.0, 0.0), 1, 0), ((1.0, 1.0), 7, 39), ((0.5, 0.25), 4, 10), ((0.0, 1.0), 1, 39)]
)
def test_the_sheet_has_end_1_above_and_d_on_the_left(place: tuple[float, float], row: int, column: int) -> None:
    sheet = draw_sheet(place, True, 40)
    assert [(y, line.index("O") - 4) for y, line in enumerate(sheet) if "O" in line] == [(row, column)]
    assert "B" in sheet[0]
    assert "A" in sheet[-1]
    assert "?" in "".join(draw_sheet(place, False, 40))
    assert not {"O", "?"} & {*"".join(draw_sheet(None, True, 40))}
