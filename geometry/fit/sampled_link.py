"""Link as the search sees it: its rays, samples of its hull, what areas count, and the axes about which sheets may lie.

The cones and the other developables of a link are looked for on the same samples and from the same axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coneskin.geometry.mesh import Mesh
from coneskin.geometry.ray_casting import RayCaster

from .candidates import AxisCandidate, find_axis_candidates
from .fit_options import FitOptions
from .surface_samples import SurfaceSamples, sample_surface
from .touch_weights import TouchWeights, exposure_weights

__all__ = ["SEARCH_SAMPLES", "SampledLink", "sample_link"]

SEARCH_SAMPLES = 6000  #: points on the mesh from which the axes are found, whatever is asked


@dataclass(frozen=True, slots=True, eq=False)
class SampledLink:
    """A link with all that every search on it needs.

    Attributes:
        mesh: the link.
        rays: a ray caster of the mesh.
        hull: samples by which sheets are looked for.
        counted: samples by which coverage is measured.
        weights: what areas count; None where all count the same.
        axes: about which sheets may lie.
    """

    mesh: Mesh
    rays: RayCaster
    hull: SurfaceSamples
    counted: SurfaceSamples
    weights: TouchWeights | None
    axes: list[AxisCandidate]

    @property
    def hull_area(self) -> float:
        """Area visible from outside [m2]."""
        return len(self.hull) * self.hull.area

    @property
    def weighed_area(self) -> float:
        """Area visible from outside, by the weights [m2]."""
        if self.weights is None:
            return self.hull_area
        return float(self.weights.at(self.hull.points).sum()) * self.hull.area

    @property
    def worth(self) -> NDArray[np.float64] | None:
        """What each counted sample counts, shape (n,); None where all count the same."""
        return None if self.weights is None else self.weights.at(self.counted.points)


def sample_link(mesh: Mesh, options: FitOptions, progress: Callable[[str], None]) -> SampledLink:
    """Sample a link and find its axes; nothing is drawn by chance.

    Args:
        mesh: the link.
        options: of the search.
        progress: called with the name of each step.

    Raises:
        GeometryError: the weights are not about this link.
        MeshError: no face of the mesh is visible from outside.
    """
    progress("sampling the hull")
    rays = RayCaster(mesh)
    hull = sample_surface(mesh, rays, SEARCH_SAMPLES)
    counted = hull if options.samples == SEARCH_SAMPLES else sample_surface(mesh, rays, options.samples)
    weights = options.weights
    if options.exposure:
        progress("casting rays to the outside")
        weights = exposure_weights(hull, rays)
    if weights is not None:
        weights.check_place(hull.points)
    progress("looking for axes")
    return SampledLink(mesh, rays, hull, counted, weights, find_axis_candidates(hull))
