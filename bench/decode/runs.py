"""Runs of the decoder for bench `decode`: sittings of frames go in as bytes, and what it says of each touch comes out.

The bytes are packed here, so that the frames share no code with the decoder. Each sitting learns its untouched frames,
then each of its touches begins from there.
"""

from __future__ import annotations

import gc
import struct
import time
from binascii import crc_hqx
from dataclasses import dataclass

import numpy as np

from coneskin.geometry.frustum import Frustum
from coneskin.skin.detection.events import SkinFault
from coneskin.skin.detection.frame.settings import DetectorSettings
from coneskin.skin.detection.stream import TouchStream
from coneskin.skin.electronics import Electronics
from coneskin.skin.sensor import Sensor
from coneskin.skin.tolerance import IDEAL_SHEETS, SheetTolerance
from tests.support.field.converter_plant import ConverterPlant
from tests.support.field.flat_plant import FlatPlant

LEARNED_FRAMES = 300  # frames of each sitting without a touch
FRAME_PERIOD = 1e-3  # s
_FRAME_BODY = struct.Struct("<HBBHBBHI10H")


@dataclass
class Sitting:
    """Frames of one sensor that has been learned once.

    Attributes:
        plant: the sheets.
        circuit: the electronics.
        untouched: counts, shape (frames, 10).
        touches: counts, shape (touches, frames, 10).
        drift: standard deviation by which untouched currents may drift from one frame of a touch to the next, as the
            decoder is told, a ratio; 0: its own default.
        tolerance: of the sheets, as the decoder is told.
        known: ohms per square of the untouched sheets when they were commissioned; empty: it is not told.
    """

    plant: FlatPlant
    circuit: ConverterPlant
    untouched: np.ndarray
    touches: np.ndarray
    drift: float = 0.0
    tolerance: SheetTolerance = IDEAL_SHEETS
    known: tuple[float, ...] = ()

    def sensor(self) -> Sensor:
        """Return what the decoder is told; leads are 1 ohm by default."""
        plant, circuit = self.plant, self.circuit
        parts = Electronics(
            supply_volts=circuit.supply,
            adc_volts=circuit.adc,
            adc_bits=circuit.bits,
            pulldown_ohms=circuit.pulldown,
            input_ohms=circuit.input,
            current_full_scale=circuit.full_scale,
        )
        height = (plant.slant**2 - (plant.radius2 - plant.radius1) ** 2) ** 0.5
        cone = Frustum(plant.radius1, plant.radius2, height, plant.wrap)
        sheets = {"upper_sheet_ohms": plant.upper, "lower_sheet_ohms": plant.lower}
        return Sensor(cone, electronics=parts, tolerance=self.tolerance, known_ohms=self.known, **sheets)

    def settings(self) -> DetectorSettings:
        """Return the settings of its detector."""
        return DetectorSettings(current_drift=self.drift / FRAME_PERIOD) if self.drift else DetectorSettings()


def packet(sequence: int, counts: list[int]) -> bytes:
    """Return the bytes of a frame of 36 bytes, device 0, sensor 0."""
    head = (0x3AC5, 1, 36, 0, 0, 0, sequence & 0xFFFF, round(1e6 * FRAME_PERIOD * sequence) & 0xFFFFFFFF)
    body = _FRAME_BODY.pack(*head, *counts)
    return body + crc_hqx(body, 0).to_bytes(2, "big")


def decode(sitting: Sitting) -> dict[str, np.ndarray]:
    """Decode the touches of one sitting.

    Returns:
        u [m] and phi [rad], valid, touched, covariance (uu, us, ss) [m^2] or NaN, and seconds, each of shape (touches,
        frames); notone, whether a touch is told as not one disc; faults, whether any was reported.
    """
    sensor, untouched, touches = sitting.sensor(), sitting.untouched, sitting.touches
    learning = [packet(number, counts) for number, counts in enumerate(untouched.tolist())]
    shape = touches.shape[:2]
    out = {name: np.full(shape, np.nan) for name in ("u", "phi", "uu", "us", "ss")}
    out |= {name: np.zeros(shape, bool) for name in ("valid", "touched")}
    out |= {"seconds": np.full(shape, np.nan), "faults": np.zeros(shape[0], bool), "notone": np.zeros(shape, bool)}
    out["named"] = np.full(shape[0], "", object)
    clock = time.perf_counter
    gc.disable()
    for k, frames in enumerate(touches.tolist()):
        stream = TouchStream([sensor], sitting.settings())  # compiled, one that has learned cannot be copied
        for number, data in enumerate(learning):
            stream.feed(data, FRAME_PERIOD * number)
        detector = stream.detectors[0]
        if not stream.ready:
            raise RuntimeError(f"not ready after {len(learning)} frames: {detector.fault}")
        for n, counts in enumerate(frames):
            number = len(untouched) + n
            data = packet(number, counts)
            began = clock()
            events = stream.feed(data, FRAME_PERIOD * number)
            out["seconds"][k, n] = clock() - began
            for event in events:
                if isinstance(event, SkinFault):
                    out["faults"][k], out["named"][k] = True, f"{event.fault.name}: {event.detail}"
            reading = detector.reading_now
            if reading is None:
                continue
            out["u"][k, n], out["phi"][k, n] = reading.u, reading.phi
            out["valid"][k, n], out["touched"][k, n] = reading.location_valid, True
            out["notone"][k, n] = reading.elongation is not None
            if reading.covariance is not None:
                out["uu"][k, n], out["us"][k, n], out["ss"][k, n] = reading.covariance
    gc.enable()
    return out
