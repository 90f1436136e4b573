"""A sensor on the bench: frames as its electronics would measure them, without noise."""

from collections.abc import Sequence

from coneskin.geometry.frustum import Frustum
from coneskin.skin.circuit import Contact, Wiring, measure
from coneskin.skin.ladder import Ladder
from coneskin.skin.sensor import Sensor
from coneskin.skin.wire import Frame

UR10 = Frustum(0.054, 0.054, 0.434)
CONE = Frustum(0.04, 0.07, 0.15)


def measured(sensor: Sensor, contacts: Sequence[Contact] = (), wiring: Wiring | None = None, **changes: int) -> Frame:
    """One frame of a sensor with these contacts; fields may be overwritten."""
    sheets = Ladder().admittance(sensor, contacts)
    volts = measure(sensor, (sheets, sheets, sheets), wiring)
    parts = sensor.electronics
    counts = [
        parts.count_amperes(value) if name.endswith("current") else parts.count_volts(value)
        for name, value in volts._asdict().items()
    ]
    return Frame(1, sensor.device_id, sensor.sensor_id, 0, 0, 0, *counts)._replace(**changes)
