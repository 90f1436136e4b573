"""The virtual skin behind a real serial port: bytes through a pseudo-terminal and pyserial, and what is detected."""

import math
import time

from coneskin.errors import SkinConnectionError, SkinTimeout
from coneskin.geometry.frustum import Frustum
from coneskin.skin.events import TouchMoved
from coneskin.skin.faults import Faults
from coneskin.skin.pseudo_terminal import PseudoTerminal
from coneskin.skin.scripted_touch import ScriptedTouch
from coneskin.skin.sensor import Sensor
from coneskin.skin.serial_port import SerialPort
from coneskin.skin.stream import Stream
from coneskin.skin.virtual import VirtualSkin

sensor = Sensor(Frustum(0.054, 0.054, 0.434), name="tube skin")
touch = ScriptedTouch(start=0.2, end=0.4, u=0.200, phi=math.radians(90))
skin = VirtualSkin(sensor, [touch], faults=Faults(drop_every=97), duration=0.6)  # a line that loses 1 frame in 97

stream = Stream([sensor])
with PseudoTerminal(skin, hold=True) as device, SerialPort(device.path) as port:
    device.begin()
    start = time.monotonic()
    while True:
        try:
            data = port.read(timeout=0.5)
        except (SkinConnectionError, SkinTimeout) as exc:  # a fault, never "no touch"
            print(f"the end: {type(exc).__name__}")
            break
        for event in stream.feed(data, time.monotonic()):
            if isinstance(event, TouchMoved):
                continue
            where = f" at u = {1e3 * event.u:.0f} mm" if hasattr(event, "u") else f": {event}"
            print(f"{event.time - start:6.3f} s  {type(event).__name__}{where}")

detector = stream.detectors[0]
print(f"{stream.decoder.frames} frames, {detector.timing.missing} missing")
