"""Potential on the sheets, as one viewer chooses to see it; nobody else sees what it chose.

A touch says where it is and how firm, not how large: the contact is a disc of 5 mm, smaller beside an edge. Its
conductance is the one with which the exact model (``coneskin.skin.field``) reads the level.
"""

from __future__ import annotations

import math
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from coneskin.core.errors import FieldError
from coneskin.geometry.pose import Pose

from .stage.level_scale import gradient

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from coneskin.core.arrays import Floats
    from coneskin.skin.field.disc import Disc
    from coneskin.skin.field.fourport import DrivePhase
    from coneskin.skin.sensor import Sensor

    from .run_course import Moment
    from .stage.stage import SheetSurface, Stage

#: what can be drawn -> the phase, and whether it is the upper sheet
_PHASE_SHEETS = {
    "radial phase, upper sheet": ("radial", True),
    "angular phase, lower sheet": ("angular", False),
    "touch phase, upper sheet": ("touch", True),
    "touch phase, lower sheet": ("touch", False),
}
_DISC_RADIUS = 0.005  # m; of the disc
_EDGE_SHARE = 0.8  # of the way to the nearest edge, that the disc takes at most
_FIELD_TOLERANCE = 1e-6  # of the supply; a colour is far coarser
_CONDUCTANCE_COUNT = 49  # conductances
_LEAST, _MOST = 1e-8, 1e-1  # S


class _ContactOnSheet(NamedTuple):
    """Contact: u [m], phi [rad], and the touch level that was read."""

    u: float
    phi: float
    level: float


class _SheetField:
    """Field of one sensor at fixed points.

    Args:
        u: slant distances of the points from end 1 [m].
        phi: azimuths of the points [rad], in the shape of ``u``.

    Attributes:
        supply: the potential that drives it [V].
    """

    def __init__(self, sensor: Sensor, u: Floats, phi: Floats) -> None:
        from coneskin.skin.field.model import FieldModel
        from coneskin.skin.field.sheet import SectorSheet

        self.supply = sensor.electronics.supply_volts
        self._sensor, self._u, self._phi = sensor, u, phi
        self._model = FieldModel(
            SectorSheet.of_frustum(sensor.frustum), sensor.upper_sheet_ohms, sensor.lower_sheet_ohms, _FIELD_TOLERANCE
        )
        self._known: tuple[object, Floats] | None = None

    def potentials(self, what: str, contact: _ContactOnSheet | None) -> Floats:
        """Return the potentials at the points [V].

        Args:
            what: one of ``_PHASE_SHEETS``.
            contact: on the sheet; None for none, and where it is too near to an edge for a disc it is left out.

        Raises:
            FieldError: the model cannot solve this contact.
        """
        from coneskin.skin.field.maps import FieldMap

        name, upper = _PHASE_SHEETS[what]
        near = None if contact is None else (round(contact.u, 3), round(contact.phi, 2), round(contact.level, 2))
        if self._known is not None and self._known[0] == (what, near):
            return self._known[1]
        phase = self._phase(name)
        disc = None if contact is None else self._disc(contact)
        by_upper, by_lower = FieldMap.of(self._model, () if disc is None else (disc,), phase).potentials(
            self._u, self._phi
        )
        found = by_upper if upper else by_lower
        self._known = ((what, near), found)
        return found

    def _disc(self, contact: _ContactOnSheet) -> Disc | None:
        """Return the disc that reads the contact's level; None where there is no room for one, or the level is 0."""
        from coneskin.skin.field.disc import Disc

        sheet = self._model.sheet
        u = min(max(contact.u, 0.0), sheet.width)
        phi = min(max(contact.phi, 0.0), sheet.wrap)
        radius = min(_DISC_RADIUS, _EDGE_SHARE * float(sheet.edge_distances(u, phi).min()))
        if radius < 1e-4 or contact.level <= 0.0:
            return None
        tried = np.geomspace(_LEAST, _MOST, _CONDUCTANCE_COUNT) / (math.pi * radius * radius)
        coupling = self._model.contacts(np.full(_CONDUCTANCE_COUNT, u), np.full(_CONDUCTANCE_COUNT, phi), radius, tried)
        guides = self._model.read(coupling, self._phase("touch")).terminals[:, 2:]
        levels = guides.mean(axis=1) / self.supply  # rises with the conductance
        return Disc(u, phi, radius, float(np.exp(np.interp(contact.level, levels, np.log(tried)))))

    def _phase(self, name: str) -> DrivePhase:
        """Return a phase as the electronics of the sensor make it."""
        from coneskin.skin.field.fourport import DrivePhase, Terminal

        parts = self._sensor.electronics
        supply, b, c = parts.supply_volts, self._sensor.b_positive, self._sensor.c_positive
        driven: dict[str, tuple[float | None, ...]] = {  # A, B, C, D; None: a guide, which is read
            "radial": (0.0 if b else supply, supply if b else 0.0, None, None),
            "angular": (None, None, supply if c else 0.0, 0.0 if c else supply),
            "touch": (supply, supply, None, None),
        }
        guide = parts.pulldown_ohms if name == "touch" else parts.input_ohms
        leads = (parts.lead_ohms.a, parts.lead_ohms.b, parts.lead_ohms.c, parts.lead_ohms.d)
        ports = zip(driven[name], leads, strict=True)
        return DrivePhase(name, *(Terminal(v or 0.0, guide if v is None else 0.0, lead) for v, lead in ports))


#: vertices and faces of a patch before it is placed and scaled
_UNIT_SQUARE = (((-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0)), ((0, 1, 2), (0, 2, 3)))
_ROWS, _COLUMNS = 32, 48
_PATCH_HEIGHT = 0.0035  # m above the surface that is sensed: over the sheet as it is drawn
_PATCH_OVERLAP = 1.03  # of a patch's size, so that no gap is seen between two
_COLOUR_BANDS = 20  # colours: the edges between them are lines of equal potential
_LOW_TO_HIGH = ((49, 18, 92), (44, 96, 160), (38, 152, 138), (122, 198, 80), (250, 224, 60))


class _FieldPatches(NamedTuple):
    """Patches of a sheet, row by row along u."""

    u: Floats  #: slant distances of their middles [m], shape (n,)
    phi: Floats  #: azimuths of them [rad], shape (n,)
    positions: NDArray[np.float32]  #: of the middles in the frame of the link [m], shape (n, 3)
    rotations: NDArray[np.float32]  #: w, x, y, z; a patch's x is around, its y along, shape (n, 4)
    sizes: NDArray[np.float32]  #: around, along, and 1 [m], shape (n, 3)

    @classmethod
    def of(cls, sheet: SheetSurface) -> _FieldPatches:
        """Return the patches of a sheet."""
        placed = sheet.item.frustum
        cone = placed.frustum
        edges_u, edges_phi = np.linspace(0.0, cone.slant, _ROWS + 1), np.linspace(0.0, cone.wrap, _COLUMNS + 1)
        rows, columns = np.meshgrid(
            0.5 * (edges_u[:-1] + edges_u[1:]), 0.5 * (edges_phi[:-1] + edges_phi[1:]), indexing="ij"
        )
        u, phi = rows.ravel(), columns.ravel()
        points, normals = placed.place(u, phi)
        if sheet.item.surface is not None:
            points = np.array([sheet.item.surface.point(a, b) for a, b in zip(u.tolist(), phi.tolist(), strict=True)])
        points = points + _PATCH_HEIGHT * normals
        step = 1e-4 * cone.slant
        along = placed.place(u + step, phi)[0] - placed.place(u - step, phi)[0]
        along /= np.linalg.norm(along, axis=1)[:, None]
        around = np.cross(along, normals)
        rotations = np.stack([around, along, normals], axis=2).tolist()
        turned = [Pose.trusted(rows, (0.0, 0.0, 0.0)).quaternion for rows in rotations]
        radius = cone.radius1 + (cone.radius2 - cone.radius1) * u / cone.slant + _PATCH_HEIGHT
        widths = 2.0 * radius * math.tan(0.5 * cone.wrap / _COLUMNS) * _PATCH_OVERLAP
        sizes = np.column_stack([widths, np.full_like(u, _PATCH_OVERLAP * cone.slant / _ROWS), np.ones_like(u)])
        return cls(u, phi, points.astype("float32"), np.array(turned, dtype="float32"), sizes.astype("float32"))


def _potential_colours(volts: Floats, low: float, high: float) -> NDArray[np.uint8]:
    """Return the colours of potentials [V], shape (n,), in bands from a low one to a high one."""
    share = np.clip((volts - low) / max(high - low, 1e-12), 0.0, 1.0)
    band = np.minimum(np.floor(share * _COLOUR_BANDS), _COLOUR_BANDS - 1) / (_COLOUR_BANDS - 1)
    knots = np.linspace(0.0, 1.0, len(_LOW_TO_HIGH))
    columns = [np.interp(band, knots, [colour[k] for colour in _LOW_TO_HIGH]) for k in range(3)]
    return np.column_stack(columns).round().astype(np.uint8)


def _as_light(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return colours of a screen (sRGB, IEC 61966-2-1) as light, which is how viser 1.1 takes those of patches."""
    share = colours / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return (255.0 * light).round().astype(np.uint8)


_FIELD_OFF = "off"
_FLAT_SPAN = 1e-3  # of the supply: what differs by less than this is drawn in one colour


class FieldChoice:
    """Choice of one viewer.

    Args:
        client: viser's ``ClientHandle``.
        stages: on the page, each with the name of the node above it.

    Attributes:
        on_update: has a function called when the viewer chooses.
    """

    def __init__(self, client: Any, stages: list[tuple[Stage, str]]) -> None:
        self._scene, self._stages = client.scene, stages
        self._fields: dict[str, tuple[_SheetField, _FieldPatches]] = {}
        self._nodes: dict[str, Any] = {}
        self._choice = client.gui.add_dropdown("potential", (_FIELD_OFF, *_PHASE_SHEETS), initial_value=_FIELD_OFF)
        self._legend = client.gui.add_html("")
        self.on_update = self._choice.on_update

    def stand(self, stages: list[tuple[Stage, str]]) -> None:
        """Take other stages in the place of those before."""
        self._clear()
        self._fields.clear()
        self._stages = stages

    def show(self, moments: list[Moment]) -> None:
        """Draw what is chosen, at a moment of each stage."""
        what = str(self._choice.value)
        if what not in _PHASE_SHEETS:
            self._clear()
            return
        shown, said = [], ""
        for (stage, root), moment in zip(self._stages, moments, strict=True):
            for sheet in stage.sheets:
                name = f"{root}/link {sheet.link}/potential of {stage.sheets.index(sheet)}"
                if name not in self._fields:
                    patches = _FieldPatches.of(sheet)
                    self._fields[name] = _SheetField(sheet.sensor, patches.u, patches.phi), patches
                field, patches = self._fields[name]
                contact = _contact_on(sheet, moment)
                try:
                    volts = field.potentials(what, contact)
                except FieldError as exc:
                    said = f"{sheet.name}: {exc}"
                    volts = field.potentials(what, None)
                shown.append((name, patches, volts, field.supply))
        low, high = _range(shown)
        for name, patches, volts, _ in shown:
            self._draw(name, patches, _as_light(_potential_colours(volts, low, high)))
        legend = _legend(low, high, said)
        if legend != self._legend.content:
            self._legend.content = legend

    def _draw(self, name: str, patches: _FieldPatches, colours: Any) -> None:
        node = self._nodes.get(name)
        if node is not None:
            if not np.array_equal(node.batched_colors, colours):
                node.batched_colors = colours
            return
        square = np.array(_UNIT_SQUARE[0], dtype="float32"), np.array(_UNIT_SQUARE[1])
        look = {"batched_colors": colours, "side": "double", "cast_shadow": False, "receive_shadow": False}
        there = {"batched_positions": patches.positions, "batched_scales": patches.sizes, "lod": "off"}
        self._nodes[name] = self._scene.add_batched_meshes_simple(name, *square, patches.rotations, **there, **look)

    def _clear(self) -> None:
        for node in self._nodes.values():
            node.remove()
        self._nodes.clear()
        if self._legend.content:
            self._legend.content = ""


def _contact_on(sheet: SheetSurface, moment: Moment) -> _ContactOnSheet | None:
    """Return the contact that touches a sheet at a moment; None for none."""
    level = moment.levels[sheet.name]
    for mark in moment.marks:
        if mark.sensor == sheet.name and mark.strength >= 1.0 and level > 0.0:
            u, phi, _ = sheet.item.frustum.locate(mark.point)
            return _ContactOnSheet(u, phi, level)  # beside the sheet: drawn at its nearer edge
    return None


def _range(shown: list[Any]) -> tuple[float, float]:
    """Return from where to where the colours go [V]: as far as anything drawn, the whole supply where it is all one."""
    low, high = min(float(volts.min()) for _, _, volts, _ in shown), max(float(volts.max()) for _, _, volts, _ in shown)
    supply = max(supply for _, _, _, supply in shown)
    return (low, high) if high - low > _FLAT_SPAN * supply else (0.0, supply)


def _legend(low: float, high: float, said: str) -> str:
    colours = [
        (int(r), int(g), int(b)) for r, g, b in _potential_colours(np.linspace(low, high, 41), low, high).tolist()
    ]
    wrong = f'<div style="color:#b91c1c">{escape(said[:300])}</div>' if said else ""
    return (
        '<div id="coneskin-potential" style="font-size:12px;margin:4px 10px">'
        f'<div style="height:10px;background:{gradient(colours)}"></div>'
        f'<div style="display:flex;justify-content:space-between"><span>{low:.3f} V</span><span>{high:.3f} V</span>'
        "</div><div>a contact is drawn as a disc of 5 mm that gives the level that was read</div>"
        f"{wrong}</div>"
    )
