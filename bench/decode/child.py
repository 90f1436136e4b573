"""Decoder of whatever coneskin is on the path, in a process of its own, on a file of frames: bench `decode` asks it.

    python -m bench decode-child FRAMES.npz ANSWERS.npz

Frames go in as the bytes of version 1, the answers are what any version tells of a touch: place, validity, covariance.
Each sitting learns its untouched frames, then each of its touches begins from there.
"""

from __future__ import annotations

import copy
import gc
import struct
import sys
import time
from binascii import crc_hqx
from pathlib import Path

import numpy as np

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.events import SkinFault
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.electronics import Electronics
from coneskin.skin.sensor import Sensor

_BODY = struct.Struct("<HBBHBBHI10H")
PERIOD = 1e-3  # s


def packet(sequence: int, counts: list[int]) -> bytes:
    """Return the bytes of a frame of version 1, device 0, sensor 0."""
    head = (0x3AC5, 1, 36, 0, 0, 0, sequence & 0xFFFF, round(1e6 * PERIOD * sequence) & 0xFFFFFFFF)
    body = _BODY.pack(*head, *counts)
    return body + crc_hqx(body, 0).to_bytes(2, "big")


def sensor_of(given: dict[str, float]) -> Sensor:
    """Return the sensor that the file describes."""
    height = (given["slant"] ** 2 - (given["radius2"] - given["radius1"]) ** 2) ** 0.5
    parts = Electronics(
        supply_volts=given["supply"],
        adc_volts=given["adc"],
        adc_bits=int(given["bits"]),
        pulldown_ohms=given["pulldown"],
        input_ohms=given["input"],
        current_full_scale=given["full_scale"],
    )  # leads of 1 ohm are every version's default
    cone = Frustum(given["radius1"], given["radius2"], height, given["wrap"])
    return Sensor(cone, electronics=parts, upper_sheet_ohms=given["upper"], lower_sheet_ohms=given["lower"])


def answer(
    sensor: Sensor, settings: DetectorSettings, untouched: np.ndarray, touches: np.ndarray
) -> dict[str, np.ndarray]:
    """Decode the touches of one sitting.

    Args:
        sensor: the sensor.
        settings: of its detector.
        untouched: counts, shape (frames, 10).
        touches: counts, shape (touches, frames, 10).

    Returns:
        u [m] and phi [rad], valid, touched, covariance (uu, us, ss) [m^2] or NaN, each of shape (touches, frames);
        seconds, the time of the first frame; faults, whether any was reported.
    """
    learned = TouchStream([sensor], settings)
    for number, counts in enumerate(untouched.tolist()):
        learned.feed(packet(number, counts), PERIOD * number)
    if not learned.ready:
        raise RuntimeError(f"the sensor is not ready after {len(untouched)} frames: {learned.detectors[0].fault}")
    shape = touches.shape[:2]
    out = {name: np.full(shape, np.nan) for name in ("u", "phi", "uu", "us", "ss")}
    out |= {name: np.zeros(shape, bool) for name in ("valid", "touched")}
    out |= {"seconds": np.full(shape, np.nan), "faults": np.zeros(shape[0], bool), "notone": np.zeros(shape, bool)}
    clock = time.perf_counter
    gc.disable()
    for k, frames in enumerate(touches.tolist()):
        stream = copy.deepcopy(learned, {id(sensor): sensor})
        detector = stream.detectors[0]
        for n, counts in enumerate(frames):
            number = len(untouched) + n
            data = packet(number, counts)
            began = clock()
            events = stream.feed(data, PERIOD * number)
            out["seconds"][k, n] = clock() - began
            out["faults"][k] |= any(isinstance(event, SkinFault) for event in events)
            reading = detector.reading_now
            if reading is None:
                continue
            out["u"][k, n], out["phi"][k, n] = reading.u, reading.phi
            out["valid"][k, n], out["touched"][k, n] = reading.location_valid, True
            several = reading.doubt.startswith("the drive currents")  # before elongations were told
            out["notone"][k, n] = reading.elongation is not None if hasattr(reading, "elongation") else several
            covariance = getattr(reading, "covariance", None)
            if covariance is not None:
                out["uu"][k, n], out["us"][k, n], out["ss"][k, n] = covariance
    gc.enable()
    return out


def main() -> None:
    given = np.load(sys.argv[1])
    answers: dict[str, np.ndarray] = {}
    for number in range(int(given["sittings"])):
        names = given[f"sensor names {number}"]
        told = dict(zip(names.tolist(), given[f"sensor {number}"].tolist(), strict=True))
        settings = DetectorSettings(current_drift=told["drift"] / PERIOD) if told["drift"] else DetectorSettings()
        found = answer(sensor_of(told), settings, given[f"untouched {number}"], given[f"touches {number}"])
        answers |= {f"{name} {number}": values for name, values in found.items()}
    with Path(sys.argv[2]).open("wb") as file:
        np.savez(file, **answers)


if __name__ == "__main__":
    main()
