"""Picture of a jig: no cut plane of a part is seen edge-on, which would look as if the picture were cropped."""

import math

import pytest

from coneskin.design.link_picture import _clear_azimuth


@pytest.mark.parametrize("cuts", [(0.0, math.pi), (0.4, 2.0, 2.1, 3.6), (0.01, 1.8, 3.2), (0.0, 1.571, 3.141, 4.712)])
@pytest.mark.parametrize("turned", [1.0, -1.0])
def test_no_cut_is_seen_edge_on(cuts: tuple[float, ...], turned: float) -> None:
    view = _clear_azimuth(turned * cut for cut in cuts)
    assert min(abs(math.sin(view - turned * cut)) for cut in cuts) > 0.35, "20 degrees at least"
