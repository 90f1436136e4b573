"""A truncated cone and its flat sector: the same point on both."""

import math

import coneskin as cs

cone = cs.Frustum(radius1=0.040, radius2=0.070, height=0.150, wrap=math.radians(270))
sector = cs.unroll(cone)
print(f"sector: r1 {1e3 * sector.r1:.3f} mm, r2 {1e3 * sector.r2:.3f} mm, theta0 {math.degrees(sector.theta0):.3f} deg")

u, phi = 0.080, math.radians(120)
x, y, z = cone.point(u, phi)
flat_x, flat_y = cone.flat_point(u, phi)
print(f"u = 80 mm, phi = 120 deg is at ({1e3 * x:.2f}, {1e3 * y:.2f}, {1e3 * z:.2f}) mm on the link")
print(f"and at ({1e3 * flat_x:.2f}, {1e3 * flat_y:.2f}) mm on the sheet")

# a cylinder needs no case of its own: its sector is a rectangle, so r is infinite and theta0 is 0
tube = cs.Frustum(radius1=0.054, radius2=0.054, height=0.434)
print(f"a cylinder: r1 {cs.unroll(tube).r1} m, width {1e3 * cs.unroll(tube).arc1:.2f} mm")

again = cs.roll_up(sector, cone.wrap)
print(f"rolled up again: radii {1e3 * again.radius1:.3f} and {1e3 * again.radius2:.3f} mm")
