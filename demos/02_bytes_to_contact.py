"""One frame of 36 bytes becomes a touch, and the touch a point and a normal on a UR10e's upper arm."""

import math

import coneskin as cs

SCENE = """
[arm]
model = "UR10e"
host = "127.0.0.1"

[[link]]
name = "upper_arm"

[[link.sensor]]
radius1_mm = 60.5
radius2_mm = 60.5
height_mm = 400
xyz_mm = [0, 0, 100]
"""

scene = cs.parse_scene(SCENE)
sensor = scene.sensors[0].sensor
stream = cs.TouchStream([sensor])

# the bytes that the electronics would send while a finger rests at u = 250 mm, phi = 60 deg
finger = cs.ScriptedTouch(start=0.1, end=0.3, u=0.250, phi=math.radians(60))
for time, data in cs.VirtualSkin(sensor, [finger], duration=0.2).packets():
    for event in stream.feed(data, time):
        touch = event
print(f"on the wire: {data.hex(' ', 4)}")
print(
    f"level {touch.level:.2f}, u = {1e3 * touch.u:.1f} mm, phi = {math.degrees(touch.phi):.1f} deg, "
    f"certain: {touch.location_valid}"
)

(on_arm,) = cs.place_on_arm(scene)
q = [math.radians(angle) for angle in (0, -60, 90, -120, -90, 0)]
point, normal = on_arm.place_in_base(touch.u, touch.phi, q)
print("point in the base frame  [mm]: " + ", ".join(f"{1e3 * value:8.2f}" for value in point))
print("outward normal there         : " + ", ".join(f"{value:8.4f}" for value in normal))
