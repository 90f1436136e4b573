"""Search for the sheets of a link: cones, or developables of another section where they cover more."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from coneskin.geometry.fit.cones import LinkFit, fit_cones
from coneskin.geometry.fit.developable.packing import with_developables
from coneskin.geometry.fit.fit_options import FitOptions
from coneskin.geometry.fit.sampled_link import sample_link
from coneskin.geometry.mesh import Mesh

__all__ = ["find_sheets"]


def find_sheets(
    mesh: Mesh,
    options: FitOptions | None = None,
    *,
    round_only: bool = False,
    progress: Callable[[str], None] | None = None,
    **named: Any,
) -> LinkFit:
    """Find the sheets that cover most of a link: cones, or developables of another section where they cover more.

    Args:
        mesh: the link.
        options: what is asked of the sheets; None for the values that ``FitOptions`` has by itself.
        round_only: True for cones only.
        progress: called with the name of each step.
        named: options by their names, instead of those in ``options``.

    Raises:
        GeometryError: an option is out of range.
        MeshError: no face of the mesh is visible from outside.
    """
    options = replace(options or FitOptions(), **named)
    say = progress or (lambda _: None)
    link = sample_link(mesh, options, say)
    cones = fit_cones(link, options, say)
    return cones if round_only else with_developables(link, cones, options, say)
