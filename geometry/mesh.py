"""Link meshes: read from a file, converted to metres by the unit that the file gives, welded and checked.

The only importer of trimesh.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from coneskin.core.arrays import Bools, Floats, Ints, frozen
from coneskin.core.errors import MeshError, MissingExtra
from coneskin.core.files import explain_os_error, read_file

from .placed_frustum import MAX_LENGTH
from .pose import Pose


def _outermost_points(points: Floats) -> Floats:
    """Return those of points [m] that are corners of their hull; all of them where it has no volume."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(points[np.sort(ConvexHull(points).vertices)])
    except QhullError:
        return points


class _ColladaAsset(NamedTuple):
    """Asset element of a COLLADA document; what is missing there has COLLADA's own defaults."""

    unit: str = "m"
    metres: float = 1.0
    up_axis: str = "Y_UP"


def _read_collada_asset(path: Path, data: bytes) -> _ColladaAsset:
    """Read unit and up axis of a COLLADA file, whose entities are known to be harmless."""
    asset = _ColladaAsset()
    try:
        root = ElementTree.fromstring(data)
        # a tool's own unit may stand in an extra inside, and parts of the document have assets of their own
        if (unit := root.find("{*}asset/{*}unit")) is not None:
            asset = asset._replace(unit=unit.get("name", "unit"), metres=float(unit.get("meter", "1")))
        if (up_axis := root.find("{*}asset/{*}up_axis")) is not None:
            asset = asset._replace(up_axis=(up_axis.text or asset.up_axis).strip())
    except ElementTree.ParseError as error:
        raise MeshError(f"{path}: malformed XML: {error}") from error
    except ValueError as error:
        raise MeshError(f"{path}: the unit tag must hold a number of metres: {error}") from error
    if not (math.isfinite(asset.metres) and asset.metres > 0.0):
        raise MeshError(f"{path}: the unit tag must hold metres above 0, got {asset.metres}")
    return asset


UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254}  #: metres in one unit
SUFFIXES = (".stl", ".obj", ".dae", ".ply")
MAX_SIZE = 100_000_000  # bytes of a file; 2 million triangles, and a link is modelled with 10 000
MIN_LENGTH = 0.005  # m; a shorter mesh is in another unit
MIN_THICKNESS = 0.0005  # m; a thinner mesh is a flat drawing
_RESTRICTED_MODELS = re.compile(r"ur(20|30)(?!\d)", re.IGNORECASE)


def terms_of(name: str) -> tuple[str, ...]:
    """Return a note on the terms of use, if a file or a link has the name of a model whose maker restricts them."""
    if not _RESTRICTED_MODELS.search(name):
        return ()
    return (
        "this looks like a mesh of a UR20 or UR30: Universal Robots' terms for these forbid physical models for "
        "commercial purposes",
    )


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of one link, in the frame of the link."""

    vertices: Floats  #: corners [m], shape (n, 3), all distinct
    faces: Ints  #: indices of three corners, shape (m, 3), each with an area; their winding may be inconsistent
    source: str = "mesh"  #: its origin, for messages
    unit: str = "m"  #: the unit of the file, a key of ``UNITS`` or, for COLLADA, the name in its unit tag
    notes: tuple[str, ...] = ()  #: guesses and changes made while reading, one sentence each

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen(self.vertices, (None, 3), "vertices"))
        faces = np.array(self.faces, dtype=np.int64)
        faces.setflags(write=False)
        object.__setattr__(self, "faces", faces)

    @property
    def triangles(self) -> Floats:
        """Corners of every face [m], shape (m, 3, 3)."""
        return self.vertices[self.faces]

    @cached_property
    def normals_and_areas(self) -> tuple[Floats, Floats]:
        """Unit normals by the winding of the file, shape (m, 3), and the areas [m2], shape (m,)."""
        cross = _edge_products(self.vertices, self.faces)
        twice = np.sqrt((cross * cross).sum(axis=0))
        normals, areas = (cross / twice).T, 0.5 * twice
        for array in (normals, areas):
            array.setflags(write=False)
        return normals, areas

    @cached_property
    def outermost(self) -> Floats:
        """Corners of the convex hull [m], shape (k, 3): how far a link reaches in any direction, they reach."""
        return frozen(_outermost_points(self.vertices), (None, 3), "outermost")

    @property
    def border_share(self) -> float:
        """Share of the edges that border one face only: near 0 on models, nearly a half where 30 % of faces lack."""
        edges = np.sort(self.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        counts = np.unique(edges[:, 0] * len(self.vertices) + edges[:, 1], return_counts=True)[1]
        return float((counts == 1).mean())

    @cached_property
    def own_frame(self) -> tuple[Floats, Floats]:
        """A frame that belongs to the surface, whatever its faces and its pose are.

        Its origin is the centroid of the surface [m], shape (3,); its axes are the principal ones, as columns, shape
        (3, 3), each towards the side to which the surface reaches further (third moments). It may be left-handed, so
        that a mirrored surface has the mirrored frame.
        """
        corners, areas = self.triangles, self.normals_and_areas[1]
        # four nodes in a face give its moments up to the third exactly (Strang and Fix)
        sums = corners.sum(axis=1, keepdims=True)
        nodes = np.concatenate([0.4 * corners + 0.2 * sums, sums / 3.0], axis=1).reshape(-1, 3)
        weights = np.outer(areas, (25.0, 25.0, 25.0, -27.0)).ravel()
        middle = weights @ nodes / weights.sum()
        off = nodes - middle
        ways = np.linalg.eigh((off * weights[:, None]).T @ off)[1]
        return np.asarray(middle), ways * np.where(weights @ (off @ ways) ** 3 < 0.0, -1.0, 1.0)

    @property
    def size(self) -> Floats:
        """Extents along the axes of the frame [m], shape (3,)."""
        return np.asarray(np.ptp(self.vertices, axis=0))

    def moved(self, pose: Pose) -> Mesh:
        """Return the same mesh in the outer frame of a pose."""
        return Mesh(pose.apply_all(self.vertices), self.faces, self.source, self.unit, self.notes)

    def part(self, chosen: Bools) -> Mesh:
        """Return the mesh of some faces, with the corners that they use; ``chosen`` has the shape (m,)."""
        used, faces = _numbered_anew(self.faces[chosen], len(self.vertices))
        return Mesh(self.vertices[used], faces, self.source, self.unit, self.notes)

    @cached_property
    def embree_intersector(self) -> Callable[[Floats, Floats], Ints] | None:
        """A function that casts rays with embree, through trimesh; None without the package embreex.

        The function takes origins [m] and directions, both of shape (n, 3), and returns the index of the first face hit
        by each ray, -1 for none, shape (n,).
        """
        try:
            import trimesh
            from trimesh.ray.ray_pyembree import RayMeshIntersector
        except ImportError:
            return None
        body = trimesh.Trimesh(self.vertices, self.faces, process=False, validate=False)
        first: Callable[[Floats, Floats], Ints] = RayMeshIntersector(body).intersects_first
        return first


def load_mesh(path: str | Path, unit: str | None = None, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Mesh:
    """Read a link's mesh. Its axes are kept, whatever COLLADA's up_axis says, as in RViz, MoveIt and Gazebo.

    Args:
        path: an STL, OBJ, DAE (COLLADA) or PLY file.
        unit: the file's unit, a key of ``UNITS``; None to take COLLADA's unit tag (unless it makes a link of over 5 m
            where millimetres make one), or to guess: a mesh of a largest extent under 5 is taken to be in metres, a
            larger one in millimetres. What was taken is in ``Mesh.notes``.
        scale: factors along the axes, after the unit, as a URDF's mesh tag has them.

    Returns:
        the mesh in metres, all parts of the file merged and welded.

    Raises:
        MeshError: no such file, not a mesh, an empty one, or a shape that cannot be a link.
        MissingExtra: a COLLADA file without pycollada.
    """
    path = Path(path)
    if unit is not None and unit not in UNITS:
        raise MeshError(f"unit must be one of {', '.join(UNITS)}, got {unit!r}")
    with explain_os_error(MeshError, str(path)):
        data = read_file(path, MAX_SIZE)
    if path.suffix.lower() not in SUFFIXES:
        raise MeshError(f"{path}: a mesh is read from {', '.join(SUFFIXES)}, got {path.suffix or 'no suffix'}")
    if not data:
        raise MeshError(f"{path}: the file is empty")
    notes = list(terms_of(str(path.resolve())))
    metres = None if unit is None else UNITS[unit]
    asset = None
    if path.suffix.lower() == ".dae":
        _refuse_entities(data, path)
        asset = _read_collada_asset(path, data)
        if asset.up_axis != "Z_UP":
            notes.append(f"the file declares {asset.up_axis}; its axes are kept, as in RViz and MoveIt")
    vertices, faces = _read(path, data)
    _check_corners(faces, len(vertices), str(path))
    if metres is None:
        extent = float((np.ptp(vertices[_numbered_anew(faces, len(vertices))[0]], axis=0) * np.abs(scale)).max())
        unit, metres, note = _unit(extent, asset)
        notes.append(note)
    if tuple(scale) != (1.0, 1.0, 1.0):
        notes.append(f"scaled by {scale[0]:g}, {scale[1]:g}, {scale[2]:g}")
    return make_mesh(vertices * (metres * np.asarray(scale, float)), faces, str(path), unit or "m", notes)


def _unit(extent: float, asset: _ColladaAsset | None) -> tuple[str, float, str]:
    """Return the unit of a file from its largest extent: its name, its length in metres, and a note that says why.

    Makers ship COLLADA files whose numbers are millimetres and whose tag says metres; a tag that makes the link longer
    than any, where millimetres make one, is not believed.
    """
    if asset is not None:
        name, metres = asset.unit, asset.metres
        if not (extent * metres > MAX_LENGTH and MIN_LENGTH <= extent * 1e-3 <= MAX_LENGTH):
            return name, metres, f"unit {name} ({metres:g} m), from the COLLADA file"
        note = f"the COLLADA file declares its unit as {name}, which makes a link of {extent * metres:.4g} m: "
        return "mm", 0.001, f"{note}taken as mm, {extent:.4g} mm; name the unit if that is wrong"
    unit, metres = ("m", 1.0) if extent < MAX_LENGTH else ("mm", 0.001)
    return unit, metres, f"unit {unit} guessed from the largest extent, {extent:g}"


def make_mesh(
    vertices: Any, faces: Any, source: str = "mesh", unit: str = "m", notes: list[str] | tuple[str, ...] = ()
) -> Mesh:
    """Weld corners that coincide, drop faces without area and check that the rest can be a link; words as of `Mesh`.

    Args:
        vertices: corners [m], shape (n, 3).
        faces: indices of three corners, shape (m, 3).

    Raises:
        MeshError: a corner that is not finite, an index out of range, or a shape that cannot be a link.
    """
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.int64)
    _check_corners(faces, len(vertices), source)
    used = np.zeros(len(vertices), bool)
    used[faces] = True
    # a coordinate at a time: numpy is slow with arrays of three columns
    columns = [np.ascontiguousarray(column) for column in vertices[used].T]
    finite = np.logical_and.reduce([np.isfinite(column) for column in columns])
    if not finite.all():
        bad = int((~finite).sum())
        raise MeshError(f"{source}: {bad} of {len(vertices)} vertices are not finite; export the mesh again")
    low = np.array([column.min() for column in columns])
    size = np.array([column.max() for column in columns]) - low
    longest = float(size.max())
    advice = f"a link measures {MIN_LENGTH * 1e3:g} mm to {MAX_LENGTH:g} m: name the file's unit (unit m, cm, mm, inch)"
    if longest == 0.0:
        raise MeshError(f"{source}: all vertices are one point")
    if longest < MIN_LENGTH:
        raise MeshError(f"{source}: only {longest * 1e3:.3g} mm long (unit {unit}); {advice}")
    if longest > MAX_LENGTH:
        raise MeshError(f"{source}: {longest:.4g} m long (unit {unit}); {advice}")
    # one 63-bit key for each corner; a cell is a millionth of the length, far below any modelled detail
    cells = [((c - least) * (2**20 / longest)).round().astype(np.int64) for c, least in zip(columns, low, strict=True)]
    _, first, inverse = np.unique(cells[0] << 42 | cells[1] << 21 | cells[2], return_index=True, return_inverse=True)
    index = np.zeros(len(vertices), np.int64)
    index[used] = inverse
    welded, faces = np.stack([column[first] for column in columns], axis=1), index[faces]
    twice = np.sqrt((_edge_products(welded, faces) ** 2).sum(axis=0))
    keep = twice > 1e-12 * longest**2
    faces = faces[keep]
    if len(faces) == 0:
        raise MeshError(f"{source}: no face has an area; the points lie on a line")
    used, faces = _numbered_anew(faces, len(welded))
    welded = welded[used]
    centred = welded - welded.mean(axis=0)
    thin = float(np.ptp(centred @ np.linalg.eigh(centred.T @ centred)[1], axis=0).min())
    if thin < max(MIN_THICKNESS, 1e-4 * longest):
        raise MeshError(
            f"{source}: flat, {longest * 1e3:.4g} mm long and {thin * 1e3:.2g} mm thick; a link must have a volume"
        )
    notes = list(notes)
    if len(welded) < len(vertices):
        notes.append(f"welded {len(vertices)} vertices to {len(welded)}")
    return Mesh(welded, faces, source, unit, tuple(notes))


def _check_corners(faces: Ints, count: int, source: str) -> None:
    """Refuse faces that refer to other than so many corners, and no faces at all."""
    if len(faces) == 0:
        raise MeshError(f"{source}: no faces")
    low, high = faces.min(), faces.max()
    if low < 0 or high >= count:
        raise MeshError(f"{source}: a face refers to corner {low if low < 0 else high}, there are {count}")


def _edge_products(vertices: Floats, faces: Ints) -> Floats:
    """Return the vector products of two edges of each face, shape (3, m); a coordinate at a time, which is faster."""
    columns = [np.ascontiguousarray(column) for column in vertices.T]
    a, b, c = (np.ascontiguousarray(column) for column in faces.T)
    ab, ac = [x[b] - x[a] for x in columns], [x[c] - x[a] for x in columns]
    return np.stack([ab[i - 2] * ac[i - 1] - ab[i - 1] * ac[i - 2] for i in range(3)])


def _numbered_anew(faces: Ints, count: int) -> tuple[Bools, Ints]:
    """Return which of so many corners faces use, shape (count,), and the faces, numbered among those."""
    used = np.zeros(count, bool)
    used[faces] = True
    return used, (np.cumsum(used) - 1)[faces]


def _refuse_entities(data: bytes, path: Path) -> None:
    """Refuse an XML text that defines entities: they could name other files, or grow a thousandfold.

    Raises:
        MeshError: it does.
    """
    if b"<!ENTITY" in data.replace(b"\0", b""):  # two bytes for each letter are allowed as well
        raise MeshError(f"{path}: an XML text that defines entities is not read; export the file without them")


def _read(path: Path, data: bytes) -> tuple[Floats, Ints]:
    """Read the corners and faces of all parts of a file, in its own unit; no file that it names is opened."""
    import trimesh

    try:
        loaded = trimesh.load(io.BytesIO(data), file_type=path.suffix[1:].lower(), process=False)
    except Exception as error:  # the readers raise errors of many types, from struct.error to KeyError
        if isinstance(error, ModuleNotFoundError) and (error.name or "").partition(".")[0] in ("collada", "lxml"):
            raise MissingExtra(error.name or "", f"reading {path.name}", "design") from error
        reason = str(error).strip().splitlines() or [type(error).__name__]
        if isinstance(error, ModuleNotFoundError):  # of the last reader that trimesh tries
            reason = ["neither binary nor text of that kind"]
        raise MeshError(f"{path}: not a readable {path.suffix[1:].upper()} file ({reason[0]})") from error
    scene = loaded if isinstance(loaded, trimesh.Scene) else trimesh.Scene([loaded])
    corners: list[Floats] = []
    faces: list[Ints] = []
    count = 0
    for node in scene.graph.nodes_geometry:
        matrix, name = scene.graph[node]
        part = scene.geometry[name]
        if len(getattr(part, "faces", ())) == 0:
            continue
        matrix = np.asarray(matrix)
        own = np.asarray(part.vertices, float)
        corners.append(own if np.array_equal(matrix, np.eye(4)) else own @ matrix[:3, :3].T + matrix[:3, 3])
        faces.append(np.asarray(part.faces, np.int64) + count)
        count += len(corners[-1])
    if not faces:
        raise MeshError(f"{path}: not a readable {path.suffix[1:].upper()} file (no triangles in it)")
    return np.concatenate(corners), np.concatenate(faces)
