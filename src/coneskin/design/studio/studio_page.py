"""Studio's page: a link with its sheets in 3D or a whole robot, handles beside it, and the layers flat."""

from __future__ import annotations

import math
import shlex
import tempfile
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from coneskin.core.arrays import Floats, Ints
from coneskin.core.errors import ConeSkinError
from coneskin.design.link_design import LinkMesh, load_link
from coneskin.design.sheets.cable_way import CABLE_RADIUS, MOUNT_REACH
from coneskin.design.sheets.sheet_design import SheetDesign
from coneskin.design.workshop.jig import jig_collars
from coneskin.geometry.fit.touch_weights import read_touch_weights
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
    robot_facts,
    warning_list,
)
from .first_view import first_view
from .workbench import Handles, RobotLinks, Wish, Workbench

_LINK_COLOR = (205, 208, 214)
_SHEET_COLOR = (164, 205, 150)
_CABLE_COLOR = (55, 65, 81)
_COLLAR_COLOR = (253, 186, 116)
_MESH_SUFFIXES = {".stl", ".obj", ".dae", ".ply"}
_LETTER_SIZE = 1.6  # of viser's own size of letters, 12 pixels
_SHOWN_FIRST = "lower conductive"  # layer of the flat drawing that says most
_HANDLE_STEP = 0.5  # mm and deg of the handles
_SHORTEST = 10.0  # mm along the axis
_MOST_WIRES = 40
_LINK_SENSORS = _MOST_WIRES // 4  # numbers of sensors that are kept for each link of a robot
_ALL_LINKS = "the whole robot"
_EVEN, _FREE = "all areas alike", "open space above it"


class StudioPage:
    """Page of the studio, for one person.

    Args:
        server: of the page.
        shown: the workbench of a link; or the links of a robot, of which one is opened after another.
        folder: where the design is written; of a robot a folder in it for each link.
        overwrite: an earlier design there may be replaced.
        load: makes the workbench of a mesh file that was put onto the page.
    """

    def __init__(
        self,
        server: PageServer,
        shown: Workbench | RobotLinks,
        folder: Path,
        overwrite: bool,
        load: Callable[[LinkMesh], Workbench],
    ) -> None:
        self._server, self._folder, self._overwrite, self._load = server, folder, overwrite, load
        self._robot = shown if isinstance(shown, RobotLinks) else None
        self._bench = shown if isinstance(shown, Workbench) else None
        self._lock = threading.Lock()  # the page's callbacks come from several threads
        self._held: tuple[int, str] | None = None  # handle that made the last change
        self._replaceable: set[Path] = set()  # folders that were written here, or that were asked for twice
        gui = server.gui
        if self._robot is not None:
            self._link = gui.add_dropdown("link", [_ALL_LINKS, *self._robot.names], initial_value=_ALL_LINKS)
            self._link.on_update(lambda _event: self._open())
        self._legend = gui.add_html("")
        self._said = gui.add_html("")
        self._upload = gui.add_upload_button(
            "another link, or a map of touches",
            mime_type="*/*",
            hint="STL, OBJ, DAE or PLY; a map is a CSV file with x_mm, y_mm, z_mm, weight; or drop it anywhere",
        )
        self._upload.on_upload(lambda _event: self._take_upload())
        self._layer = gui.add_dropdown("layer", ["none"], initial_value="none")
        self._layer.on_update(lambda _event: self._draw_flat())
        self._flat = gui.add_html("")
        self._handles: list[Any] = []  # one folder for each sheet, and the buttons that add one to a surface
        self._titles: list[Any] = []  # of the sheets
        self._place_of_handles = gui.add_folder("sheets")
        with self._place_of_handles:
            self._undo = gui.add_button("undo")
            self._undo.on_click(lambda _event: self._change(lambda bench: bench.undo()))
        finding = gui.add_folder("find again", expand_by_default=False)
        with finding:
            self._wires = gui.add_slider("wires at most", 4, _MOST_WIRES, 4, 8)
            self._count = gui.add_dropdown("what counts", [_EVEN, _FREE], initial_value=_EVEN)
            self._find = gui.add_button("find sheets")
            self._find.on_click(lambda _event: self._find_again())
        self._collars = gui.add_checkbox("show the collars", False)
        self._collars.on_update(lambda _event: self._change(lambda _bench: None))
        self._warnings = gui.add_html("")
        self._facts = gui.add_html("")
        self._write = gui.add_button(f"write {folder}")
        self._write.on_click(lambda _event: self._written())
        self._told = gui.add_html("")  # where a person looks who has pressed the button
        self._of_a_link = (self._layer, self._place_of_handles, finding, self._collars, self._write)
        self._stand()

    def _stand(self) -> None:
        """Draw the link that is open, or all of a robot, and make the handles."""
        scene = self._server.scene
        scene.reset()
        scene.set_up_direction("+z")
        light_plainly(scene)
        for of_a_link in self._of_a_link:
            of_a_link.visible = self._bench is not None
        if self._bench is None:
            self._draw_robot()
        else:
            self._rays = RayCaster(self._bench.link.mesh)
            self._server.look_from(*first_view(self._bench.designs, self._rays, self._bench.link.mesh.vertices))
            self._legend.content = legend(self._bench.wish.fit.tolerance)
            self._add_mesh("/link", self._bench.link.mesh.vertices, self._bench.link.mesh.faces, _LINK_COLOR)
            self._draw()
        self._make_handles()

    def _add_mesh(self, name: str, vertices: Floats, faces: Ints, colour: tuple[int, int, int], **more: Any) -> None:
        plain = {"side": "double", "flat_shading": True, "cast_shadow": False, "receive_shadow": False}
        self._server.scene.add_mesh_simple(name, vertices.astype("float32"), faces, color=colour, **plain | more)

    def _draw_robot(self) -> None:
        """Draw all links of a robot, with the sheets of those that were opened."""
        robot = self._robot
        rows: list[tuple[str, Sequence[SheetDesign] | str]] = []
        assert robot is not None
        corners = []
        for name, pose in robot.poses().items():
            try:
                mesh = robot.link(name).mesh
            except ConeSkinError as exc:
                rows.append((name, str(exc)))
                continue
            corners.append(pose.apply_all(mesh.vertices))
            self._add_mesh(f"/robot/{name}", corners[-1], mesh.faces, _LINK_COLOR)
            bench = robot.opened.get(name)
            for design in () if bench is None else bench.designs:
                triangles = pose.apply_all(design.outer_triangles().reshape(-1, 3))
                faces = np.arange(len(triangles)).reshape(-1, 3)
                self._add_mesh(f"/robot/{name}/{design.name}", triangles, faces, _SHEET_COLOR)
            rows.append((name, "not opened" if bench is None else bench.designs))
        self._server.look_from(*first_view((), None, np.concatenate(corners or [np.eye(3)])))
        self._legend.content, self._flat.content, self._warnings.content = "", "", ""
        self._facts.content = robot_facts(rows)

    def _open(self) -> None:
        """Open the link of a robot that was chosen."""
        robot, name = self._robot, str(self._link.value)
        assert robot is not None
        self._say("" if name in robot.opened or name == _ALL_LINKS else f"looking for sheets on {name} ...")
        try:
            bench = None if name == _ALL_LINKS else robot.open(name)
        except ConeSkinError as exc:
            self._say(f"{name}: {exc}")
            return
        with self._lock:
            if self._link.value != name:  # another was chosen meanwhile
                return
            self._bench, self._held = bench, None
            self._stand()
        self._say("" if bench is None else f"{name}: {_count_of(bench.designs)}")

    def _make_handles(self) -> None:
        for made in self._handles:
            made.remove()
        self._handles, self._titles, bench, gui = [], [], self._bench, self._server.gui
        if bench is None:
            return
        with self._place_of_handles:
            for number, handles in enumerate(bench.wish.handles):
                self._handles.append(gui.add_folder(f"on surface {handles.side + 1}"))
                with self._handles[-1]:
                    self._titles.append(gui.add_html(""))
                    self._handles_of(number, handles)
            sides = [f"surface {number}" for number in range(1, len(bench.wish.fit.sheets) + 1)]
            if sides:
                adding = gui.add_button_group("add a sheet", sides)
                adding.on_click(lambda _event: self._change(lambda bench: bench.add(sides.index(adding.value))))
                self._handles.append(adding)
        self._name_handles()

    def _name_handles(self) -> None:
        """Name each set of handles as the sheet that it moves."""
        bench = self._bench
        assert bench is not None
        names = dict(zip(bench.places, (design.name for design in bench.designs), strict=True))
        for number, title in enumerate(self._titles):
            title.content = _note("coneskin-sheet", names.get(number, "cannot be made"))

    def _handles_of(self, number: int, handles: Handles) -> None:
        """Make the sliders of one sheet, and the button that deletes it."""
        assert self._bench is not None
        gui, side = self._server.gui, self._bench.wish.fit.sheets[handles.side].frustum
        longest, widest = round(1e3 * side.height, 1), round(math.degrees(side.wrap), 1)
        turn = 360.0 if side.wrap >= math.tau else widest
        length, wrap = (
            most if value is None else min(round(unit * value, 1), most)
            for value, unit, most in ((handles.length, 1e3, longest), (handles.wrap, 180.0 / math.pi, widest))
        )
        sliders = {
            "start": gui.add_slider(
                "start [mm]",
                0.0,
                max(longest - _SHORTEST, 1.0),
                _HANDLE_STEP,
                min(round(1e3 * handles.along, 1), longest),
            ),
            "length": gui.add_slider("length [mm]", _SHORTEST, longest, _HANDLE_STEP, length),
            "wrap": gui.add_slider("wrap [deg]", 30.0, widest, 0.1, wrap),
            "turn": gui.add_slider(
                f"{'seam' if turn == 360.0 else 'turn'} [deg]",
                0.0,
                turn,
                _HANDLE_STEP,
                round(math.degrees(handles.seam), 1),
            ),
        }
        made, moves = self._handles, dict.fromkeys(sliders, 0)

        def moved(name: str) -> None:
            moves[name] += 1
            mine = moves[name]
            with self._lock:
                bench = self._bench
                if mine != moves[name] or bench is None or self._handles is not made:
                    return  # a later move of it waits, or these handles are no more
                along, length, wrap, seam = (float(slider.value) for slider in sliders.values())
                whole = length >= longest, wrap >= widest
                wanted = Handles(
                    handles.side,
                    1e-3 * along,
                    None if whole[0] else 1e-3 * length,
                    None if whole[1] else math.radians(wrap),
                    math.radians(seam),
                )
                bench.handle(number, wanted, again=self._held == (number, name))
                self._held = number, name
                self._draw()
                self._name_handles()

        for name, slider in sliders.items():
            slider.on_update(lambda _event, name=name: moved(name))
        gui.add_button("delete").on_click(lambda _event: self._change(lambda bench: bench.delete(number)))

    def _change(self, change: Callable[[Workbench], None], of: Workbench | None = None) -> None:
        """Change the sheets by a button, and make their handles anew; nothing where another link is open by then."""
        with self._lock:
            if self._bench is None or (of is not None and self._bench is not of):
                return
            self._held = None
            try:
                change(self._bench)
            except ConeSkinError as exc:
                self._say(str(exc))
                return
            self._say("")
            self._draw()
            self._make_handles()

    def _find_again(self) -> None:
        bench, wires = self._bench, int(self._wires.value)
        if bench is None:
            return
        search = {name: value for name, value in bench.wish.search.items() if name not in ("weights", "exposure")}
        search |= {"max_wires": wires, "max_sheets": wires // 4, "exposure": self._count.value == _FREE}
        if self._count.value not in (_EVEN, _FREE):
            search["weights"] = self._map
        self._say("looking for sheets ...")
        try:
            wish = Wish.found(bench.link, bench.options, **search)
        except ConeSkinError as exc:
            self._say(str(exc))
            return
        self._change(lambda bench: bench.change(wish), of=bench)
        self._say(f"found {_count_of(wish.handles)}")

    def _draw(self) -> None:
        """Draw the sheets as they are now, with their cables, on the link and in the panel."""
        bench, scene = self._bench, self._server.scene
        assert bench is not None
        tolerance = bench.wish.fit.tolerance
        with self._server.together():
            scene.add_frame("/sheets", show_axes=False)  # replaces the one before, and all that was below it
            for design in bench.designs:
                name = f"/sheets/{design.name}"
                for number, band in enumerate(deviation_bands(self._rays, design.place, tolerance)):
                    self._add_mesh(f"{name}/band {number}", band.vertices, band.faces, band.colour, flat_shading=False)
                cable = design.way.points + CABLE_RADIUS * design.way.normals
                strands = np.stack([cable[:-1], cable[1:]], axis=1).astype("float32")
                scene.add_line_segments(f"{name}/cable", strands, colors=_CABLE_COLOR, thickness=2.0 * CABLE_RADIUS)
                for what, at in (("tie", design.way.tie), ("connector", len(cable) - 1)):
                    scene.add_icosphere(
                        f"{name}/{what}", MOUNT_REACH / 2, _CABLE_COLOR, position=cable[at], cast_shadow=False
                    )
                others = [other for other in bench.designs if other is not design]
                made = jig_collars(design, bench.link.mesh, (), others)[0] if self._collars.value else ()
                for collar in made:
                    pose = design.place.link_frustum @ collar.pose
                    for part in collar.parts:
                        corners, faces = pose.apply_all(part.surface.vertices), np.asarray(part.surface.faces)
                        at_end = f"{name}/collar {collar.slug(part)}"
                        self._add_mesh(at_end, corners, faces, _COLLAR_COLOR, opacity=0.6)
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
        self._warnings.content = warning_list(bench.warnings())
        layers = [f"{design.name}: {cut.name}" for design in bench.designs for cut in design.cuts] or ["none"]
        if list(self._layer.options) != layers:
            self._layer.options = layers
            self._layer.value = next((layer for layer in layers if layer.endswith(_SHOWN_FIRST)), layers[0])
        self._tell("")
        self._draw_flat()

    def _draw_flat(self) -> None:
        chosen = str(self._layer.value)
        for design in () if self._bench is None else self._bench.designs:
            for cut in design.cuts:
                if f"{design.name}: {cut.name}" == chosen:
                    self._flat.content = flat_drawing(cut)
                    return
        self._flat.content = ""

    def _take_upload(self) -> None:
        """Find the sheets of a mesh file that was put onto the page, or take a map of touches."""
        file = self._upload.value
        suffix = Path(file.name).suffix.lower()
        if suffix == ".csv":
            self._take_map(file)
            return
        if suffix not in _MESH_SUFFIXES:
            self._say(f"{file.name} is no {', '.join(sorted(_MESH_SUFFIXES))} or .csv file")
            return
        self._say(f"looking for sheets in {file.name} ...")
        try:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"link{suffix}"  # the name that a page sends is no path of ours
                path.write_bytes(file.content)
                found = next(iter(load_link(str(path))))
            stem = "".join(letter for letter in Path(file.name).stem if letter.isalnum() or letter in "-_ ")[:40]
            frame = found.frame.replace(path.name, file.name)
            bench = self._load(LinkMesh(stem or "link", found.mesh, frame, found.notes))
        except (ConeSkinError, OSError) as exc:
            self._say(f"{file.name}: {str(exc).removeprefix(f'{path}: ')}")
            return
        with self._lock:
            if self._upload.value is not file:  # another was dropped meanwhile, and is the one that is wanted
                return
            self._bench, self._held = bench, None
            self._replaceable.clear()
            self._stand()
        self._say(f"{file.name}: {_count_of(bench.designs)}")

    def _take_map(self, file: Any) -> None:
        """Take a map of touches, by which sheets may then be found again."""
        self._say(f"reading {file.name} ...")
        try:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "map.csv"
                path.write_bytes(file.content)
                self._map = replace(read_touch_weights(path), name=file.name)
        except (ConeSkinError, OSError) as exc:
            self._say(f"{file.name}: {str(exc).removeprefix(f'{path}: ')}")
            return
        self._count.options = [_EVEN, _FREE, file.name]
        self._count.value = file.name
        self._say(f'{file.name} is loaded: press "find sheets" to use it')

    def _written(self) -> None:
        bench = self._bench
        if bench is None:
            return
        folder, first = self._folder, 0
        if self._robot is not None:
            folder, known = folder / bench.link.name, self._robot.names
            first = _LINK_SENSORS * known.index(bench.link.name) if bench.link.name in known else 0
        if folder.exists() and not self._overwrite and folder not in self._replaceable:
            self._replaceable.add(folder)
            self._tell(f"{folder} exists already: press again to replace the design in it")
            return
        self._write.disabled = True
        self._tell(f"writing {folder} ... (drawings and pictures take some seconds)")
        try:
            with self._lock:
                files = bench.write(folder, overwrite=True, first_sensor=first)
        except ConeSkinError as exc:
            self._tell(str(exc))
        except OSError as exc:  # a full disk
            self._tell(f"{folder} cannot be written: {exc.strerror or exc}")
        else:
            self._replaceable.add(folder)
            next_step = f"coneskin init {shlex.quote(str(folder))} --simulated"
            self._tell(f"written: {len(files)} files in {folder}; next: {next_step}")
        finally:
            self._write.disabled = False

    def _say(self, text: str) -> None:
        self._said.content = _note("coneskin-said", text)

    def _tell(self, text: str) -> None:
        self._told.content = _note("coneskin-told", text)


def _count_of(sheets: Sequence[object]) -> str:
    return f"{len(sheets)} sheet{'s'[: len(sheets) != 1]}"


def _note(name: str, text: str) -> str:
    """Return a line for the panel, with a name by which a browser finds it."""
    return f'<div id="{name}" style="font-size:13px;margin:4px 10px"><b>{escape(text)}</b></div>'
