"""Reading of a touch: what the newest valid frame says while its sensor is touched."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["TouchReading"]


class TouchReading(NamedTuple):
    """One frame of a touch; events come only where something changes, this comes with every frame."""

    time: float  #: host clock when the frame arrived [s]
    level: float  #: how firmly, 0..1, the drift of the untouched sensor taken off
    u: float  #: slant distance from end 1 [m]; while the touch rests, the mean of its frames
    phi: float  #: azimuth [rad], likewise
    location_valid: bool  #: u and phi can be trusted
    doubt: str  #: why the place is not certain, for people; empty where it is
    clock_us: int  #: device clock of the frame [us], modulo 2**32
    sequence: int  #: sequence number of the frame
    covariance: tuple[float, float, float] | None = None  #: uu, us, ss [m^2], s along the circle
    radius: float | None = None  #: of a round contact [m]; None where the frames do not tell
    radius_deviation: float | None = None  #: standard deviation of its logarithm
    elongation: tuple[float, float] | None = None  #: of what is not one disc: half length [m], direction [rad]
    velocity: tuple[float, float] = (0.0, 0.0)  #: along the side and around [m/s]
