"""One frame of 36 bytes becomes a touch, and the touch a point and a normal on a UR10e's upper arm."""

import itertools
import math

from coneskin.build import place_on_arm
from coneskin.robot.kinematics import link_pose
from coneskin.robot.ur_models import model
from coneskin.scene_reader import parse_scene
from coneskin.skin.reading import read
from coneskin.skin.scripted_touch import ScriptedTouch
from coneskin.skin.virtual import VirtualSkin
from coneskin.skin.wire import Decoder, encode

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

scene = parse_scene(SCENE)
sensor = scene.sensors[0].sensor

# what the electronics would measure while a finger rests at u = 250 mm, phi = 60 deg
skin = VirtualSkin(sensor, [ScriptedTouch(0.0, 1.0, u=0.250, phi=math.radians(60))])
_, measured = next(itertools.islice(skin.frames(), 100, None))
data = encode(measured)
print(f"on the wire: {data.hex(' ', 4)}")

(frame,) = Decoder().feed(data)
reading = read(sensor, frame)
print(
    f"level {reading.level:.2f}, u = {1e3 * reading.u:.1f} mm, phi = {math.degrees(reading.phi):.1f} deg, "
    f"fault: {reading.fault}"
)

(placed,) = place_on_arm(scene)
point, normal = placed.place(reading.u, reading.phi)
q = [math.radians(angle) for angle in (0, -60, 90, -120, -90, 0)]
base_link = link_pose(model("UR10e"), q, placed.link)
print("point in the base frame  [mm]: " + ", ".join(f"{1e3 * value:8.2f}" for value in base_link.apply(point)))
print("outward normal there         : " + ", ".join(f"{value:8.4f}" for value in base_link.rotate(normal)))
