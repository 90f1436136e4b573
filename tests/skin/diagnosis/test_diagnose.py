"""Every mistake of the corpus is named by the first line, and none by a wrong name; the bytes come from a C program."""

import random
from pathlib import Path

import pytest

from coneskin.core.finding import Finding
from coneskin.geometry.frustum import Frustum
from coneskin.skin.diagnosis.capture import Capture, CaptureWindow
from coneskin.skin.diagnosis.cause import Cause
from coneskin.skin.diagnosis.diagnose import diagnose
from coneskin.skin.diagnosis.foreign_checksum import crc16, find_checksum
from coneskin.skin.diagnosis.frame_numbers import measure_numbers
from coneskin.skin.electronics import Electronics
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import WiringFaults
from coneskin.skin.virtual.fault_injection import FaultInjection
from coneskin.skin.virtual.imperfections import Imperfections
from coneskin.skin.virtual.scripted_touch import ScriptedTouch
from coneskin.skin.virtual.skin import VirtualSkin
from coneskin.skin.wire import encode, frame_at

from .corpus import BAUD, CLOCK_RATIOS, MISTAKES, NOT_TO_BE_NAMED, WITH_A_SCENE, build, bytes_of

SECONDS = 0.7  # of bytes; a line that falls silent is heard for longer
SENSOR = Sensor(Frustum(0.054, 0.054, 0.434))


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("mistakes"))


def heard(program: Path, mistake: str, sensors: tuple[Sensor, ...] = ()) -> Finding:
    seconds = 1.6 if MISTAKES.get(mistake) in (Cause.STOPPED, Cause.SILENT) else SECONDS
    pieces = bytes_of(program, mistake, seconds)
    window = CaptureWindow(0.0)
    for time, piece in pieces:
        window.feed(piece, time)
    return diagnose(window.capture(seconds), sensors, BAUD)


@pytest.mark.parametrize("mistake", [*MISTAKES, *NOT_TO_BE_NAMED])
def test_a_mistake_is_named(program: Path, mistake: str) -> None:
    named = heard(program, mistake, (SENSOR,) if mistake in WITH_A_SCENE else ())
    assert named.item == {**MISTAKES, **NOT_TO_BE_NAMED}[mistake].key, named.line
    assert "\n" not in named.line
    if mistake == "only a banner":
        assert "; before, the device wrote " in named.value


@pytest.mark.parametrize("mistake", ["none", "big endian", "supply 0", "currents 0", "shifted to 16 bits"])
def test_with_a_scene_the_name_is_the_same(program: Path, mistake: str) -> None:
    assert heard(program, mistake, (SENSOR,)).item == MISTAKES[mistake].key


@pytest.mark.parametrize("mistake", CLOCK_RATIOS)
def test_the_ratio_of_the_clocks_is_measured_to_one_per_cent(program: Path, mistake: str) -> None:
    """With arrivals that a busy computer scatters over 8 ms, and once holds back for a quarter of a second."""
    jitter = random.Random(f"arrivals {mistake}")
    frames, times = [], []
    for time, piece in bytes_of(program, mistake, 2.0):
        frames.append(frame_at(piece))
        late = time + 0.008 * jitter.random() ** 4
        times.append(max(1.95 if 1.7 < time < 1.95 else late, times[-1] if times else 0.0))
    assert measure_numbers(frames, times).clock_ratio == pytest.approx(CLOCK_RATIOS[mistake], rel=0.01)


def test_a_line_of_two_seconds_is_not_kept_for_ever() -> None:
    window = CaptureWindow(0.0, span=2.0, size=1000)
    for number in range(500):
        window.feed(bytes(10), 0.01 * number)
    assert len(window.capture(5.0).data) == 1000
    assert len(CaptureWindow(0.0).capture(3.0).data) == 0
    window = CaptureWindow(0.0, span=2.0)
    for second in range(5):
        window.feed(bytes([second]), float(second))
    assert window.capture(4.0).data == bytes([2, 3, 4])


def test_a_capture_knows_when_each_byte_came() -> None:
    capture = Capture(((1.0, b"abc"), (2.0, b"d"), (4.0, b"ef")), 5.0)
    assert capture._arrivals([0, 2, 3, 4, 5]) == [1.0, 1.0, 2.0, 4.0, 4.0]
    assert (capture.duration, capture.silence) == (4.0, 1.0)


def test_the_names_of_crcs_are_those_of_the_catalogue() -> None:
    """Check values of "123456789" from the catalogue of parametrised CRC algorithms."""
    check = b"123456789"
    assert crc16(check, 0x1021) == 0x31C3  # XMODEM
    assert crc16(check, 0x1021, 0xFFFF) == 0x29B1  # CCITT-FALSE
    assert crc16(check, 0x1021, 0x1D0F) == 0xE5CC  # SPI-FUJITSU
    assert crc16(check, 0x1021, 0, reflected=True) == 0x2189  # KERMIT
    assert crc16(check, 0x8005, 0xFFFF, reflected=True) == 0x4B37  # MODBUS
    assert crc16(check, 0x8005, 0, reflected=True) == 0xBB3D  # ARC


def test_a_crc_of_any_known_polynomial_is_found_without_its_start_value() -> None:
    """Those of USB, DNP, T10-DIF, TELEDISK, CDMA2000, DECT and others, bit by bit, from a start that nobody knows."""
    draw = random.Random(2)
    for polynomial in (0x8005, 0x3D65, 0x8BB7, 0xA097, 0xC867, 0x0589, 0x5935, 0x8D95):
        frames = []
        for _ in range(4):
            body, register = draw.randbytes(8), 0x1234
            for bit in "".join(f"{byte:08b}" for byte in body):
                out = register >> 15 ^ int(bit)
                register = (register << 1 & 0xFFFF) ^ out * polynomial
            frames.append(body + register.to_bytes(2, "little"))
        found = find_checksum(frames)
        assert found.item == Cause.CRC_POLYNOMIAL.key
        assert f"its polynomial is 0x{polynomial:04X}" in found.value


@pytest.mark.parametrize(("start", "cause"), [(0xFFFF, Cause.CRC_START), (None, Cause.DAMAGED)])
def test_a_rule_that_three_of_four_checksums_follow_is_named_and_chance_is_not(start: int | None, cause: Cause) -> None:
    draw, window = random.Random(3), CaptureWindow(0.0)
    for number, (time, data) in enumerate(VirtualSkin(SENSOR, model="ladder", duration=0.03).packets()):
        if number % 4:
            tail = draw.randbytes(2) if start is None else crc16(data[:-2], 0x1021, start).to_bytes(2, "big")
            data = data[:-2] + tail
        window.feed(data, time)
    found = diagnose(window.capture(0.03), (SENSOR,), None)
    assert found.item == cause.key, found.line


def test_every_other_cause_is_in_the_corpus() -> None:
    rare = {Cause.FEW_BYTES, Cause.NIBBLES_SWAPPED, Cause.WORDS_SWAPPED, Cause.UBX, Cause.CRC_UNKNOWN}
    rare |= {Cause.CLOCK_SECONDS, Cause.HELD_UP, Cause.SHORT} | {
        Cause.SEQUENCE_RANDOM,
        Cause.SUPPLY_OFF,
        Cause.CURRENT_OFF,
    }
    assert {*Cause} - {*MISTAKES.values()} - {*NOT_TO_BE_NAMED.values()} == rare


@pytest.mark.parametrize(("length", "count", "rate"), [(36, 1, 1000.0), (40, 2, 500.0), (52, 1, 200.0)])
def test_a_skin_on_which_all_is_right_is_not_blamed(length: int, count: int, rate: float) -> None:
    """Touched or not, listened to from the middle of a frame on, with and without its scene."""
    sensors = [Sensor(Frustum(0.05, 0.07, 0.3), number, device_id=0xC53A) for number in range(count)]
    touches = [ScriptedTouch(0.3, 0.8, u=0.2, phi=2.0, force=9.0), ScriptedTouch(0.5, 2.0, u=0.1, phi=4.0)]
    skin = VirtualSkin(
        *(sensors, touches),
        rate_hz=rate,
        seed=length,
        model="ladder",
        imperfections=Imperfections(clock_ratio=1.004, supply_ratio=0.97),
        frame_length=length,
        duration=1.2,
    )
    window = CaptureWindow(0.0)
    for number, (time, data) in enumerate(skin.packets()):
        window.feed(data[17:] if number == 0 else data, time)
    for scene in ((), sensors):
        named = diagnose(window.capture(1.2), scene, BAUD)
        assert named.verdict == "ok", named.line


def test_a_current_at_full_scale_is_a_short_with_a_scene_and_without() -> None:
    faults = FaultInjection(wiring=WiringFaults(shorts=(("A", "B"),)), wiring_after=0)
    window = CaptureWindow(0.0)
    for time, data in VirtualSkin(SENSOR, model="ladder", faults=faults, duration=0.4).packets():
        window.feed(data, time)
    for scene, said in (((), "A and B are shorted"), ((SENSOR,), "A joined with B")):
        found = diagnose(window.capture(0.4), scene, None)
        assert found.item == Cause.SHORT.key
        assert said in found.value


@pytest.mark.long
def test_a_current_at_full_scale_of_a_sensor_that_is_touched_may_be_the_touches() -> None:
    """Two firm contacts far apart join most of a sheet by the other one, though the wire of A is open."""
    for opened in ((), ("A",)):
        touches = [ScriptedTouch(0.0, 1.0, u, phi, force=200.0) for u, phi in ((0.2, 0.1), (0.22, 6.1))]
        faults = FaultInjection(wiring=WiringFaults(opened=opened), wiring_after=0)
        skin, window = VirtualSkin(SENSOR, touches, model="ladder", faults=faults, duration=0.4), CaptureWindow(0.0)
        for time, data in skin.packets():
            window.feed(data, time)
        found = diagnose(window.capture(0.4), (SENSOR,), None)
        assert found.item == Cause.SHORT.key
        assert "shorted, or one of them to ground or supply; or it is touched firmly" in found.value


def test_all_currents_at_full_scale_are_the_boards() -> None:
    skin = VirtualSkin(SENSOR, model="ladder", duration=0.4)
    window = CaptureWindow(0.0)
    for time, frame in skin.frames():
        full = frame._replace(touch_current=4095, radial_current=4095, angular_current=4095)
        window.feed(encode(full), time)
    found = diagnose(window.capture(0.4), (SENSOR,), None)
    assert found.item == Cause.CURRENT_OFF.key
    assert "shunt" in found.remedy


@pytest.mark.parametrize("bits", [8, 9])
def test_a_converter_of_fewer_bits_than_the_scene_says_is_told_by_its_supply(bits: int) -> None:
    board, window = Sensor(SENSOR.frustum, electronics=Electronics(adc_bits=bits)), CaptureWindow(0.0)
    for time, data in VirtualSkin(board, model="ladder", duration=0.1).packets():
        window.feed(data, time)
    found = diagnose(window.capture(0.1), (SENSOR,), None)
    assert found.item == Cause.CONVERTER_BITS.key, found.line
    assert f"as a converter of {bits} bits, not 12" in found.value


@pytest.mark.parametrize(("volts", "named"), [(0.0, False), (0.02, True)])
def test_mains_on_the_guides_are_named_and_noise_is_not(volts: float, named: bool) -> None:
    skin = VirtualSkin(SENSOR, model="ladder", imperfections=Imperfections(mains_volts=volts), duration=0.4)
    window = CaptureWindow(0.0)
    for time, data in skin.packets():
        window.feed(data, time)
    found = diagnose(window.capture(0.4), (SENSOR,), None)
    assert found.item == Cause.NONE.key
    assert ("as by mains" in found.value) is named
