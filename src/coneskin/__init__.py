"""Touch-sensitive skin for robot arms.

coneskin.geometry   cones and cylinders, their flat sectors, poses, meshes
coneskin.skin       the sensor: bytes -> readings -> touches, and the other way round (virtual skin)
coneskin.robot      kinematics, reactions, the arm through ur_rtde, the simulated controller, the guard loop
coneskin.scene      one TOML file that says what is there
coneskin.errors     every error that coneskin raises

Importing this package loads none of them.
"""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("coneskin")
except PackageNotFoundError:  # run from a source tree that is not installed
    __version__ = "0+unknown"

__all__ = ["__version__"]
