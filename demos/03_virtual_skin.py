"""The virtual skin behind a real serial port: bytes through a pseudo-terminal and pyserial, and what is detected."""

import math
import time

import coneskin as cs

sensor = cs.Sensor(cs.Frustum(0.054, 0.054, 0.434), name="tube skin")
touch = cs.ScriptedTouch(start=0.2, end=0.4, u=0.200, phi=math.radians(90))
faults = cs.FaultInjection(drop_every=97)  # a line that loses 1 frame in 97
skin = cs.VirtualSkin(sensor, [touch], faults=faults, duration=0.6)

stream = cs.TouchStream([sensor])
with cs.PseudoTerminal(skin, hold=True) as device, cs.SerialPort(device.path) as port:
    device.begin()
    start = time.monotonic()
    while True:
        try:
            data = port.read(timeout=0.5)
        except (cs.SkinConnectionError, cs.SkinTimeout) as exc:  # a fault, never "no touch"
            print(f"stream ended: {type(exc).__name__}")
            break
        for event in stream.feed(data, time.monotonic()):
            if isinstance(event, cs.TouchMoved):
                continue
            where = f" at u = {1e3 * event.u:.0f} mm" if hasattr(event, "u") else f": {event}"
            print(f"{event.time - start:6.3f} s  {type(event).__name__}{where}")

detector = stream.detectors[0]
print(f"{stream.decoder.frames} frames, {detector.timing.missing} missing")
