"""Cones of every kind that a sheet may be cut for."""

import math

from coneskin.geometry.frustum import Frustum

#: name -> frustum; the half angles of real links are in the notes of the geometry study
SHEETS = {
    "cylinder": Frustum(0.054, 0.054, 0.434),
    "near cylinder, 0.0008 deg": Frustum(0.04298, 0.04298 + 0.427 * math.tan(math.radians(0.0008)), 0.427),
    "nearer cylinder, snapped": Frustum(0.054, 0.054 + 2e-6, 0.434),
    "cone of 0.65 deg": Frustum(0.0439, 0.0450, 0.101),
    "widening": Frustum(0.040, 0.070, 0.150),
    "flipped": Frustum(0.070, 0.040, 0.150),
    "theta0 of 276 deg": Frustum(0.050, 0.150, 0.085),
    "disc": Frustum(0.060, 0.160, 0.0),
    "flipped disc": Frustum(0.160, 0.060, 0.0),
    "partial wrap": Frustum(0.068, 0.055, 0.080, math.radians(200.0)),
}
