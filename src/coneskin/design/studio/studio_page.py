"""Studio's page: the link with its sheets in 3D, handles beside it, and the layers flat.

At first it is seen from where most of the sheets and of their seams is visible, with nothing before them.
"""

from __future__ import annotations

import math
import shlex
import tempfile
import threading
from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from coneskin.core.errors import ConeSkinError
from coneskin.design.link_design import LinkMesh, load_link
from coneskin.geometry.pose import Vector
from coneskin.geometry.ray_casting import RayCaster
from coneskin.view.page_server import PageServer
from coneskin.view.stage_nodes import light_plainly

from .design_text import (
    ELECTRODE_COLOURS,
    design_facts,
    deviation_bands,
    electrode_marks,
    flat_drawing,
    legend,
    warning_list,
)
from .workbench import Handles, Workbench

if TYPE_CHECKING:
    from coneskin.core.arrays import Floats
    from coneskin.design.sheets.sheet_design import SheetDesign

#: for the head of the page: a file that is dropped anywhere goes the way of viser's button, which takes one from its
#: dialogue alone; a browser would leave the page otherwise, and show the file
FILE_DROP = """<script>
(function () {
  const carries = (event) => event.dataTransfer !== null && [...event.dataTransfer.types].includes('Files');
  const show = (over) => { document.documentElement.style.boxShadow = over ? 'inset 0 0 0 4px #2563eb' : ''; };
  document.addEventListener('dragover', (event) => {
    if (!carries(event)) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = 'copy';
    show(true);
  }, true);
  document.addEventListener('dragleave', (event) => { if (event.relatedTarget === null) show(false); }, true);
  document.addEventListener('drop', (event) => {
    if (!carries(event)) return;
    event.preventDefault();
    show(false);
    const button = document.querySelector('input[type=file]');
    if (button === null || event.dataTransfer.files.length === 0) return;
    const first = new DataTransfer();
    first.items.add(event.dataTransfer.files[0]);
    button.files = first.files;
    button.dispatchEvent(new Event('change', { bubbles: true }));
  }, true);
})();
</script>"""

_AZIMUTH_COUNT = 24  # directions at each height
_VIEW_HEIGHTS = (20.0, 45.0, -15.0)  # deg above the horizon, the preferred one first
_FIRST_AZIMUTH = -40.0  # deg; azimuth that is taken where none is better
_PLACE_ROWS, _PLACE_COLUMNS = 4, 14  # places of a sheet that are looked at
_EYE_LIFT = 0.001  # m above the sheet, from where a place is looked for
_MIN_FACING = 0.15  # cosine; what is turned away by more is seen as a line
_SEAM_WORTH = 0.3  # worth of seeing all of a seam, beside 1 for all of a sheet
_HEIGHT_PREFERENCE = 0.1  # by which another height has to be better
_VIEW_DISTANCE = 1.55  # of the link's largest side


def _first_view(designs: Sequence[SheetDesign], rays: RayCaster, corners: Floats) -> tuple[Vector, Vector]:
    """Return from where to look, and at what [m]."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, size = 0.5 * (low + high), float((high - low).max())
    ways = _directions()
    worth = np.array([-_HEIGHT_PREFERENCE * (row // _AZIMUTH_COUNT > 0) for row in range(len(ways))])
    for design in designs:
        sheet, seam = _seen_shares(design, rays, ways)
        worth += sheet + _SEAM_WORTH * seam
    way = ways[int(np.argmax(worth))]  # the first of several that are as good
    x, y, z = (middle + _VIEW_DISTANCE * size * way).tolist()
    at_x, at_y, at_z = middle.tolist()
    return (x, y, z), (at_x, at_y, at_z)


def _seen_shares(design: SheetDesign, rays: RayCaster, ways: Floats) -> tuple[Floats, Floats]:
    """Return how much of a sheet, and of its two edges along the seam, is seen from far off.

    1 is all of it, looked at along its normal; what is seen obliquely counts by the cosine.

    Args:
        design: the sheet.
        rays: of the link's mesh.
        ways: unit vectors towards the eye, shape (n, 3).

    Returns:
        of the sheet and of its seam, each of shape (n,).
    """
    box = design.layout.field
    u = np.linspace(box.u1, box.u2, _PLACE_ROWS)
    rows, columns = np.meshgrid(u, np.linspace(box.phi1, box.phi2, _PLACE_COLUMNS), indexing="ij")
    points, normals = (found.reshape(-1, 3) for found in design.place.place(rows, columns))
    cosine = normals @ ways.T  # places, ways
    seen = np.zeros_like(cosine)
    at, way = np.nonzero(cosine > _MIN_FACING)
    depth, _ = rays.cast(points[at] + _EYE_LIFT * normals[at], ways[way])
    seen[at, way] = np.where(np.isfinite(depth), 0.0, cosine[at, way])
    grid = seen.reshape(_PLACE_ROWS, _PLACE_COLUMNS, len(ways))
    return seen.mean(axis=0), grid[:, [0, -1]].mean(axis=(0, 1))


def _directions() -> Floats:
    found = []
    for height in map(math.radians, _VIEW_HEIGHTS):
        for step in range(_AZIMUTH_COUNT):
            turn = math.radians(_FIRST_AZIMUTH) + 2.0 * math.pi * step / _AZIMUTH_COUNT
            found.append((math.cos(height) * math.cos(turn), math.cos(height) * math.sin(turn), math.sin(height)))
    return np.array(found)


_LINK_COLOR = (205, 208, 214)
_MESH_SUFFIXES = {".stl", ".obj", ".dae", ".ply"}
_LETTER_SIZE = 1.6  # of viser's own size of letters, 12 pixels
_SHOWN_FIRST = "lower conductive"  # layer of the flat drawing that says most
_HANDLE_STEP = 0.5  # mm and deg of the handles


class StudioPage:
    """Page of the studio, for one person.

    Args:
        server: of the page.
        bench: with the link and its sheets.
        folder: where the design is written.
        overwrite: an earlier design there may be replaced.
        load: makes the workbench of a mesh file that was put onto the page.
    """

    def __init__(
        self,
        server: PageServer,
        bench: Workbench,
        folder: Path,
        overwrite: bool,
        load: Callable[[LinkMesh], Workbench],
    ) -> None:
        self._server, self._bench, self._folder, self._overwrite, self._load = server, bench, folder, overwrite, load
        self._lock = threading.Lock()  # the page's callbacks come from several threads
        self._handles: list[Any] = []
        gui = server.gui
        self._legend = gui.add_html("")
        self._said = gui.add_html("")
        self._upload = gui.add_upload_button("another link (STL, OBJ, DAE, PLY), or drop it here", mime_type="*/*")
        self._upload.on_upload(lambda _event: self._take_upload())
        self._layer = gui.add_dropdown("layer", ["none"], initial_value="none")
        self._layer.on_update(lambda _event: self._draw_flat())
        self._flat = gui.add_html("")
        self._folder_of_handles = gui.add_folder("handles")
        self._warnings = gui.add_html("")
        self._facts = gui.add_html("")
        self._write = gui.add_button(f"write {folder}")
        self._write.on_click(lambda _event: self._written())
        self._told = gui.add_html("")  # where a person looks who has pressed the button
        self._stand()

    def _stand(self) -> None:
        """Draw the link of the workbench, and make a set of handles for each of its sheets."""
        bench, scene, gui = self._bench, self._server.scene, self._server.gui
        scene.reset()
        scene.set_up_direction("+z")
        light_plainly(scene)
        vertices = bench.link.mesh.vertices
        self._rays = RayCaster(bench.link.mesh)
        self._server.look_from(*_first_view(bench.designs, self._rays, vertices))
        self._legend.content = legend(bench.fit.tolerance)
        scene.add_mesh_simple(
            "/link",
            vertices.astype("float32"),
            bench.link.mesh.faces,
            color=_LINK_COLOR,
            side="double",
            flat_shading=True,
            cast_shadow=False,
            receive_shadow=False,
        )
        for handle in self._handles:
            handle.remove()
        self._handles = []
        with self._folder_of_handles:
            for number, sheet in enumerate(bench.fit.sheets):
                self._handles += self._handles_of(gui, number, sheet.frustum.height, sheet.frustum.wrap)
        self._draw()

    def _handles_of(self, gui: Any, number: int, height: float, wrap: float) -> list[Any]:
        name = f"sheet {number + 1}: "
        room, widest = math.floor(1e3 * height - 10.0), round(math.degrees(wrap), 1)
        turn = 360.0 if wrap >= 2.0 * math.pi else widest
        sliders = [
            gui.add_slider(name + "end 1 [mm off]", 0.0, float(max(room, 1)), _HANDLE_STEP, 0.0),
            gui.add_slider(name + "end 2 [mm off]", 0.0, float(max(room, 1)), _HANDLE_STEP, 0.0),
            gui.add_slider(name + "wrap [deg]", 30.0, widest, 0.1, widest),
            gui.add_slider(name + "seam [deg]", 0.0, turn, _HANDLE_STEP, 0.0),
        ]

        def changed(_event: Any) -> None:
            end1, end2, covered, seam = (float(slider.value) for slider in sliders)
            full = None if covered >= widest else math.radians(covered)
            with self._lock:
                self._bench.handle(number, Handles(1e-3 * end1, 1e-3 * end2, full, math.radians(seam)))
                self._draw()

        for slider in sliders:
            slider.on_update(changed)
        return sliders

    def _draw(self) -> None:
        """Draw the sheets as they are now, on the link and in the panel."""
        bench, scene = self._bench, self._server.scene
        with self._server.together():
            scene.add_frame("/sheets", show_axes=False)  # replaces the one before, and all that was below it
            for design in bench.designs:
                name = f"/sheets/{design.name}"
                for number, band in enumerate(deviation_bands(self._rays, design.place, bench.fit.tolerance)):
                    scene.add_mesh_simple(
                        f"{name}/band {number}",
                        band.vertices.astype("float32"),
                        band.faces,
                        color=band.colour,
                        side="double",
                        cast_shadow=False,
                        receive_shadow=False,
                    )
                for mark in electrode_marks(design):
                    colour, line = ELECTRODE_COLOURS[mark.letter], f"{name}/{mark.letter}"
                    scene.add_line_segments(line, mark.segments, colors=colour, thickness=0.002)
                    for place, at in enumerate(mark.letters.tolist()):
                        scene.add_label(
                            f"{line}/letter {place}",
                            mark.letter,
                            position=at,
                            font_screen_scale=_LETTER_SIZE,
                            depth_test=True,
                            anchor="center-center",
                        )
        self._facts.content = design_facts(bench.designs)
        self._warnings.content = warning_list(bench.warnings() or ([bench.fit.reason] if bench.fit.reason else []))
        layers = [f"{design.name}: {cut.name}" for design in bench.designs for cut in design.cuts] or ["none"]
        if list(self._layer.options) != layers:
            self._layer.options = layers
            self._layer.value = next((layer for layer in layers if layer.endswith(_SHOWN_FIRST)), layers[0])
        self._draw_flat()

    def _draw_flat(self) -> None:
        chosen = str(self._layer.value)
        for design in self._bench.designs:
            for cut in design.cuts:
                if f"{design.name}: {cut.name}" == chosen:
                    self._flat.content = flat_drawing(cut)
                    return
        self._flat.content = ""

    def _take_upload(self) -> None:
        """Find the sheets of a mesh file that was put onto the page."""
        file = self._upload.value
        suffix = Path(file.name).suffix.lower()
        if suffix not in _MESH_SUFFIXES:
            self._say(f"{file.name} is no {', '.join(sorted(_MESH_SUFFIXES))} file")
            return
        self._say(f"looking for sheets in {file.name} ...")
        try:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"link{suffix}"  # the name that a page sends is no path of ours
                path.write_bytes(file.content)
                found = next(iter(load_link(str(path))))
            stem = "".join(letter for letter in Path(file.name).stem if letter.isalnum() or letter in "-_ ")[:40]
            bench = self._load(LinkMesh(stem or "link", found.mesh, found.frame, found.notes))
        except (ConeSkinError, OSError) as exc:
            self._say(f"{file.name}: {exc}")
            return
        with self._lock:
            if self._upload.value is not file:  # another was dropped meanwhile, and is the one that is wanted
                return
            self._bench = bench
            self._stand()
        self._say(f"{file.name}: {len(bench.fit.sheets)} sheets")

    def _written(self) -> None:
        self._write.disabled = True
        self._tell(f"writing {self._folder} ... (drawings and pictures take some seconds)")
        try:
            with self._lock:
                files = self._bench.write(self._folder, self._overwrite)
        except ConeSkinError as exc:
            self._tell(str(exc))
        else:
            next_step = f"coneskin init {shlex.quote(str(self._folder))} --simulated"
            self._tell(f"written: {len(files)} files in {self._folder}; next: {next_step}")
        finally:
            self._write.disabled = False

    def _say(self, text: str) -> None:
        self._said.content = _note("coneskin-said", text)

    def _tell(self, text: str) -> None:
        self._told.content = _note("coneskin-told", text)


def _note(name: str, text: str) -> str:
    """Return a line for the panel, with a name by which a browser finds it."""
    return f'<div id="{name}" style="font-size:13px;margin:4px 10px"><b>{escape(text)}</b></div>'
