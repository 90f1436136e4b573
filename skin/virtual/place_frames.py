"""Frames for a skin that gives places: one of another kind, whose device reports u, phi and a level, as a source.

A guard records and judges frames. What the sensor's own electronics would read of one contact at that place is computed
from the ideal circuit, with a count of noise, so that recording, replay and every check of the guard stay as they are.
What only the other device can know, a fault of its own or a second contact, it has to report: as a status, or by
silence. A place is then as certain as that device is.
"""

from __future__ import annotations

import math
import random
from functools import lru_cache

from coneskin.core.errors import SensorError
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import FRAME_LENGTHS, Status, encode

from .circuit import ConverterInputs, LayerContact, ResistorLadder, frame_of, measure

_NOISE_COUNTS = 0.5  # counts; a reading without noise would be STUCK
_MAX_LEVEL = 0.97  # level; the layers are never joined without any resistance
_CACHE_SIZE = 64  # places whose readings are kept


class PlaceFrames:
    """Encoder of places, for one sensor.

    Args:
        sensor: the surface, and the electronics that the scene gives it.
        seed: of the noise.

    Attributes:
        sequence: of the next frame.
    """

    def __init__(self, sensor: Sensor, seed: int = 0) -> None:
        self._sensor = sensor
        self._noise = random.Random(f"places {seed}")
        self._read = lru_cache(maxsize=_CACHE_SIZE)(self._measure)
        self._started = False
        self.sequence = 0

    def encode(self, time: float, level: float = 0.0, u: float = 0.0, phi: float = 0.0, status: int = 0) -> bytes:
        """Return the bytes of the next frame.

        Args:
            time: when it was measured, by the device's clock [s].
            level: how firmly the skin is touched, 0 to 1; 0.1 and more is a touch by default.
            u: slant distance from end 1 [m].
            phi: azimuth [rad].
            status: bits of ``Status``, for a fault that the device has found.

        Raises:
            SensorError: the level or the time is none, or the place is off the sensor.
        """
        if not 0.0 <= level <= 1.0:
            raise SensorError(f"a level must be from 0 to 1, got {level!r}")
        if not (math.isfinite(time) and time >= 0.0):
            raise SensorError(f"the time of a frame must be finite and not negative, got {time!r} s")
        sensor, parts = self._sensor, self._sensor.electronics
        volts = self._read(min(level, _MAX_LEVEL), u, phi)
        volt, ampere = parts.full_count / parts.adc_volts, parts.full_count / parts.current_full_scale
        counts = {}
        for name, value in volts._asdict().items():
            count = round(
                value * (ampere if name.endswith("current") else volt) + self._noise.gauss(0.0, _NOISE_COUNTS)
            )
            counts[name] = min(max(count, 0), parts.full_count)
        status |= 0 if self._started else Status.RESTARTED
        self._started = True
        clock = int(time * 1e6) & 0xFFFFFFFF
        frame = frame_of((FRAME_LENGTHS[1], sensor.device_id, sensor.sensor_id, status, self.sequence, clock), counts)
        self.sequence = (self.sequence + 1) & 0xFFFF
        return encode(frame._replace(driven=None))

    def _measure(self, level: float, u: float, phi: float) -> ConverterInputs:
        contacts = [LayerContact(u, phi, self._siemens(level, u, phi))] if level > 0.0 else []
        sheets = ResistorLadder().admittance(self._sensor, contacts)
        return measure(self._sensor, [sheets] * 3)

    def _siemens(self, level: float, u: float, phi: float) -> float:
        """Return the conductance of a contact that reads with this level: both sheets are in series with it [S]."""
        sensor = self._sensor
        radial, angular = sensor.fractions(u, phi)
        sheets = radial * (1.0 - radial) * sensor.radial_ohms + angular * (1.0 - angular) * sensor.angular_ohms
        contact = 0.5 * sensor.electronics.pulldown_ohms * (1.0 / level - 1.0) - sheets
        return 1.0 / max(contact, 1.0)
