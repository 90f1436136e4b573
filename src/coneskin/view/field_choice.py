"""Choice of one viewer to see the potential on the sheets; nobody else sees what it chose."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from coneskin.core.errors import FieldError

from .stage.level_scale import gradient
from .stage.sheet_field import (
    PHASES,
    SQUARE,
    ContactOnSheet,
    FieldPatches,
    SheetField,
    linear,
    potential_colours,
)

if TYPE_CHECKING:
    from .run_course import Moment
    from .stage.stage import SheetSurface, Stage

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
        self._fields: dict[str, tuple[SheetField, FieldPatches]] = {}
        self._nodes: dict[str, Any] = {}
        self._choice = client.gui.add_dropdown("potential", (_FIELD_OFF, *PHASES), initial_value=_FIELD_OFF)
        self._legend = client.gui.add_html("")
        self.on_update = self._choice.on_update

    def stand(self, stages: list[tuple[Stage, str]]) -> None:
        """Take other stages in the place of those before."""
        self._clear()
        self._fields.clear()
        self._stages = stages

    def show(self, moments: list[Moment]) -> None:
        """Draw what is chosen.

        Args:
            moments: of the stages.
        """
        what = str(self._choice.value)
        if what not in PHASES:
            self._clear()
            return
        shown, said = [], ""
        for (stage, root), moment in zip(self._stages, moments, strict=True):
            for sheet in stage.sheets:
                name = f"{root}/link {sheet.link}/potential of {stage.sheets.index(sheet)}"
                if name not in self._fields:
                    patches = FieldPatches.of(sheet)
                    self._fields[name] = SheetField(sheet.sensor, patches.u, patches.phi), patches
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
            self._draw(name, patches, linear(potential_colours(volts, low, high)))
        legend = _legend(low, high, said)
        if legend != self._legend.content:
            self._legend.content = legend

    def _draw(self, name: str, patches: FieldPatches, colours: Any) -> None:
        import numpy as np

        node = self._nodes.get(name)
        if node is not None:
            if not np.array_equal(node.batched_colors, colours):
                node.batched_colors = colours
            return
        square = np.array(SQUARE[0], dtype="float32"), np.array(SQUARE[1])
        look = {"batched_colors": colours, "side": "double", "cast_shadow": False, "receive_shadow": False}
        there = {"batched_positions": patches.positions, "batched_scales": patches.sizes, "lod": "off"}
        self._nodes[name] = self._scene.add_batched_meshes_simple(name, *square, patches.rotations, **there, **look)

    def _clear(self) -> None:
        for node in self._nodes.values():
            node.remove()
        self._nodes.clear()
        if self._legend.content:
            self._legend.content = ""


def _contact_on(sheet: SheetSurface, moment: Moment) -> ContactOnSheet | None:
    """Return the contact that touches a sheet at a moment; None for none."""
    level = moment.levels[sheet.name]
    for mark in moment.marks:
        if mark.sensor == sheet.name and mark.strength >= 1.0 and level > 0.0:
            u, phi, _ = sheet.item.frustum.locate(mark.point)
            return ContactOnSheet(u, phi, level)  # beside the sheet: drawn at its nearer edge
    return None


def _range(shown: list[Any]) -> tuple[float, float]:
    """Return from where to where the colours go [V]: as far as anything drawn, the whole supply where it is all one."""
    low, high = min(float(volts.min()) for _, _, volts, _ in shown), max(float(volts.max()) for _, _, volts, _ in shown)
    supply = max(supply for _, _, _, supply in shown)
    return (low, high) if high - low > _FLAT_SPAN * supply else (0.0, supply)


def _legend(low: float, high: float, said: str) -> str:
    import numpy as np

    colours = [
        (int(r), int(g), int(b)) for r, g, b in potential_colours(np.linspace(low, high, 41), low, high).tolist()
    ]
    wrong = f'<div style="color:#b91c1c">{escape(said[:300])}</div>' if said else ""
    return (
        '<div id="coneskin-potential" style="font-size:12px;margin:4px 10px">'
        f'<div style="height:10px;background:{gradient(colours)}"></div>'
        f'<div style="display:flex;justify-content:space-between"><span>{low:.3f} V</span><span>{high:.3f} V</span>'
        "</div><div>a contact is drawn as a disc of 5 mm that gives the level that was read</div>"
        f"{wrong}</div>"
    )
