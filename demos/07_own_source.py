"""Another maker's skin as a source: its device gives a place and a level, and the guard's detector sees the touch."""

import math

import coneskin as cs


class PlaceSource(cs.Source):
    """Source that asks a device; a package of yours names it by an entry point of coneskin.sources."""

    name = "my device"

    def __init__(self, sensor: cs.Sensor) -> None:
        self._frames, self._number = cs.PlaceFrames(sensor), 0

    def open(self) -> None:
        """Connect to the device."""

    def close(self) -> None:
        """Leave it."""

    def fileno(self) -> int | None:
        """Return None: this device is asked, so there is nothing to wait for."""
        return None

    def read(self, timeout: float) -> bytes:  # noqa: ARG002 (this device answers at once)
        """Ask the device: here it is touched from 0.2 s to 0.4 s; a real one is asked over its own library."""
        time, self._number = self._number / 1000, self._number + 1
        if time >= 0.5:
            raise cs.SkinConnectionError(f"{self.name} is gone")
        touched = 0.2 <= time < 0.4
        return self._frames.encode(time, level=0.6 if touched else 0.0, u=0.25, phi=math.radians(60))


sensor = cs.Sensor(cs.Frustum(0.054, 0.054, 0.434))
stream = cs.TouchStream([sensor])
with PlaceSource(sensor) as source:
    for number in range(500):
        for event in stream.feed(source.read(timeout=0.1), number / 1000):
            where = (
                f"u = {1e3 * event.u:.0f} mm, phi = {math.degrees(event.phi):.0f} deg, certain: {event.location_valid}"
            )
            print(f"{type(event).__name__}: {where}")
