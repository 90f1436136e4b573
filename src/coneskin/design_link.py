"""What the LINK of ``coneskin design`` names: a mesh file, or a link of a URDF."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from .errors import MeshError

if TYPE_CHECKING:
    from .geometry.mesh import Mesh

__all__ = ["LinkMesh", "load_link"]

_NO_MODELS = re.compile(r"ur(20|30)(?!\d)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class LinkMesh:
    """The mesh of a link.

    Attributes:
        name: what to call the link.
        mesh: its surface.
        frame: the frame that its coordinates are in, in words.
        notes: what to know, one sentence each.
    """

    name: str
    mesh: Mesh
    frame: str
    notes: tuple[str, ...]


def load_link(link: str, unit: str | None = None, up_axis: str = "ignore") -> Iterator[LinkMesh]:
    """Load what a LINK names.

    Args:
        link: a mesh file, or FILE.urdf#LINK.
        unit: of a mesh file; None to guess.
        up_axis: what to do with COLLADA's up_axis tag (``load_mesh``).

    Yields:
        the meshes of the link, the best first: the visual mesh of a URDF is nearer to the real surface than its
        collision mesh, which often is a hull.

    Raises:
        MeshError: the file, the link or its mesh cannot be found or read.
    """
    from .geometry.mesh import load_mesh

    path, hash_sign, name = link.partition("#")
    if not hash_sign and not path.lower().endswith((".urdf", ".xacro")):
        mesh = load_mesh(path, unit, up_axis)
        frame = f"the mesh's coordinates in {Path(path).name}"
        yield LinkMesh(Path(path).stem, mesh, frame, (*_terms(path), *mesh.notes))
        return
    from .geometry.urdf import load_urdf_link, urdf_links

    if not name:
        raise MeshError(f"{path}: name a link as {Path(path).name}#LINK; there are: {', '.join(urdf_links(path))}")
    errors: list[MeshError] = []
    for kind in ("visual", "collision"):
        try:
            mesh = load_urdf_link(path, name, kind, up_axis=up_axis)
        except MeshError as exc:
            errors.append(exc)
            continue
        said = tuple(str(error) for error in errors)
        notes = (f"{kind} mesh of the URDF", *said, *_terms(path + name), *mesh.notes)
        yield LinkMesh(name, mesh, f"the URDF link {name}", notes)
    if len(errors) == 2:
        raise errors[0]


def _terms(name: str) -> tuple[str, ...]:
    if not _NO_MODELS.search(name):
        return ()
    return (
        "this looks like a mesh of a UR20 or UR30: Universal Robots' terms for these forbid physical models for "
        "commercial purposes",
    )
