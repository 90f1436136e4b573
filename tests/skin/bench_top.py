"""A sensor on the bench: frames as its electronics would measure them, without noise."""

from collections.abc import Sequence

from coneskin.geometry.frustum import Frustum
from coneskin.skin.sensor import Sensor
from coneskin.skin.virtual.circuit import LayerContact, ResistorLadder, WiringFaults, frame_of, measure
from coneskin.skin.wire import Frame

UR10 = Frustum(0.054, 0.054, 0.434)
CONE = Frustum(0.04, 0.07, 0.15)


def unrounded(sensor: Sensor, contacts: Sequence[LayerContact] = ()) -> dict[str, float]:
    """Counts before the converter rounds them: field of a frame -> counts."""
    sheets = ResistorLadder().admittance(sensor, contacts)
    volts = measure(sensor, (sheets, sheets, sheets))
    parts = sensor.electronics
    return {
        name: value * parts.full_count / (parts.current_full_scale if name.endswith("current") else parts.adc_volts)
        for name, value in volts._asdict().items()
        if name in Frame._fields
    }


def measured(
    sensor: Sensor, contacts: Sequence[LayerContact] = (), wiring: WiringFaults | None = None, **changes: int
) -> Frame:
    """One frame of a sensor with these contacts; fields may be overwritten."""
    sheets = ResistorLadder().admittance(sensor, contacts)
    volts = measure(sensor, (sheets, sheets, sheets), wiring)
    parts = sensor.electronics
    counts = {
        name: parts.count_amperes(value) if name.endswith("current") else parts.count_volts(value)
        for name, value in volts._asdict().items()
        if name in Frame._fields
    }

    return frame_of((36, sensor.device_id, sensor.sensor_id, 0, 0, 0), counts)._replace(**changes)
