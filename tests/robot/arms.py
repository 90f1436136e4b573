"""Arms and hypothesis strategies that several tests draw from."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import strategies as st

from coneskin.robot.arm.model import ArmModel
from coneskin.robot.arm.models import MODEL_NAMES, arm_model

#: the corrections of one real UR10, printed in calibration_test.cpp of Universal_Robots_ROS2_Driver: 440 m along axes
#: that are parallel to 1.4 mrad
FAR_UR10 = arm_model("UR10").calibrated(
    delta_d=(
        -0.000160188285741325043,
        439.140974079900957,
        -446.027059806332147,
        6.88618689642360149,
        -3.86588496858186748e-05,
        -0.00087908274257374186,
    ),
    delta_a=(
        2.12234865571205891e-05,
        0.632017132627700651,
        0.00229833638891230319,
        -4.61409023720933908e-05,
        -6.39280053471801522e-05,
        0.0,
    ),
    delta_theta=(
        -2.41478068943590252e-07,
        1.60233952386694556,
        -1.68607190752171299,
        0.0837331147700118711,
        -1.01260355871157781e-07,
        3.91986209186123702e-08,
    ),
    delta_alpha=(
        -0.000650246557584166496,
        0.00139416666825590402,
        0.00693818880325995126,
        -0.000811641562390219562,
        0.000411120504570705592,
        0.0,
    ),
)

#: another one, 1.4 m along axes that are parallel to 7 mrad
NEAR_UR10 = arm_model("UR10").calibrated(
    delta_d=(
        0.00065609212979853,
        1.4442162376284788,
        0.854147723854608,
        -2.2989425877563705,
        -1.573498686836816e-05,
        1.9072435590711256e-05,
    ),
    delta_a=(
        4.6311376834935676e-05,
        -0.00012568315331862312,
        0.00186216581161458,
        9.918593870679266e-05,
        4.215462720453189e-06,
        0.0,
    ),
    delta_theta=(
        -7.290070070824746e-05,
        -0.01713897289704999,
        -0.03707159413492756,
        0.054279462160583214,
        1.488984257025741e-07,
        1.551499479707493e-05,
    ),
    delta_alpha=(
        0.000211987863869334,
        -0.0072553625957652995,
        -0.013483226769541364,
        0.0013495820227329425,
        -0.001263136163679901,
        0.0,
    ),
)

NOMINAL = tuple(arm_model(name) for name in MODEL_NAMES)


def arms() -> st.SearchStrategy[ArmModel]:
    """Every nominal arm, and a calibrated one."""
    return st.sampled_from((*NOMINAL, NEAR_UR10))


def joints(most: float = 2.0 * math.pi) -> st.SearchStrategy[tuple[float, ...]]:
    """Joint positions, singular ones and quarter turns often among them."""
    angle = st.one_of(
        st.floats(-most, most),
        st.sampled_from([k * math.pi / 2.0 for k in range(-4, 5) if abs(k) * math.pi / 2.0 <= most]),
    )
    return st.tuples(*[angle] * 6)


def points(most: float = 0.7) -> st.SearchStrategy[tuple[float, float, float]]:
    """Points in a link's frame [m]."""
    number = st.floats(-most, most)
    return st.tuples(number, number, number)


def units() -> st.SearchStrategy[tuple[float, float, float]]:
    """Unit vectors."""

    def unit(angles: tuple[Any, Any]) -> tuple[float, float, float]:
        azimuth, height = angles
        level = math.sqrt(1.0 - height * height)
        return level * math.cos(azimuth), level * math.sin(azimuth), height

    return st.tuples(st.floats(0.0, 2.0 * math.pi), st.floats(-1.0, 1.0)).map(unit)
