"""Design of the skin of a whole robot: the sheets of all its links that one budget of wires allows.

Each link is designed as one alone is, but clear of what moves beside it: over the whole range of a joint the link on
its other side takes a space, before which sheets end, and in which no tab, tie or cable lies. Every sheet costs four
wires, so those come first on whose active area most can be touched: that is the most for each number of wires. What can
be touched is the share of the half-space above it that the whole robot leaves free, over poses drawn from the joints.
"""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from coneskin.core.errors import GeometryError, MeshError
from coneskin.geometry.drawing.nesting import require_nesting
from coneskin.geometry.fit.axis_plan import FittedSheet
from coneskin.geometry.fit.side import longest_run
from coneskin.geometry.fit.touch_weights import free_shares
from coneskin.geometry.mesh import Mesh
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster
from coneskin.geometry.urdf import UrdfJoint, link_poses, urdf_joints, urdf_links
from coneskin.skin.electronics import LeadOhms

from .cable_tree import BEND_RADIUS, BOX_LENGTH, CableRouter, CableSection, CableTree, bundle_radius, loop_length
from .folder import DESIGN_FILE, FileOptions, _Draft, _measured, _nested, _new_folder, check_target
from .link_design import LinkDesign, _fit_link, as_built, room_for
from .report import _table
from .sheets.cable_way import SphereBody
from .sheets.sheet_design import DesignOptions, SheetDesign, design_assembly
from .swept_space import _swept_beside
from .workshop.build_figures import BuildFigures, bill_of_materials, in_mm, side_name

_SWEEP_CLEARANCE = 2e-3  # m; of a sheet from what moves beside it
_SWEEP_ROW = 2e-3  # m; along a sheet
_LEAST_SLANT = 0.03  # m; a shorter rest of a sheet is not offered
_TOUCH_GRID = (6, 24)  # places of an active area along and around
_POSE_COUNT = 12
_WIRES_PER_SHEET = 4
_TIE_STEP = 0.1  # m; between places at which cables are fixed
_END_LENGTH = 0.05  # m; at each end of a cable, to strip, to crimp and to lead it down to the link
_CUT_STEP = 0.01  # m; cables are cut to multiples of it


class _Offer(NamedTuple):
    """A sheet that wires may allow, after those before it."""

    link: str
    number: int  #: on that link
    active: float  #: area [m2]
    area: float  #: of that, what can be touched [m2]
    wires: int  #: with all before
    total: float  #: area that can be touched, with all before [m2]


@dataclass(frozen=True, slots=True)
class RobotDesign:
    """The skin of a robot.

    Attributes:
        offered: all sheets, in the order in which they are included: the curve of touchable area against wires.
        included: how many of them the wires allow.
        reasons: why a link carries none, or its sheets are shortened; one sentence each.
        cables: of the sheets that are included, which are numbered as their sensors.
    """

    offered: tuple[_Offer, ...]
    included: int
    reasons: tuple[str, ...]
    cables: CableTree


_BuiltSheet = tuple[str, SheetDesign, BuildFigures]  # of a link, with its name before that of the sheet


def _assembled(
    design: LinkDesign, fits: Mapping[int, FittedSheet], options: DesignOptions, beside: Sequence[SphereBody]
) -> LinkDesign:
    """Return a link with sheets at some places, by their numbers before, and a note why not for each without room."""
    if design.fit is None or not fits:
        return dataclasses.replace(design, sheets=())
    fit = dataclasses.replace(design.fit, sheets=tuple(fits.values()), bare_areas=())
    named = dataclasses.replace(options, link=design.name)
    sheets, left_out = design_assembly(fit, named, design.mesh, beside=beside)
    numbers = [number for sheet in sheets for number, one in fits.items() if one is sheet.found]
    notes = (*_renumbered(design.notes, numbers), *left_out)
    return dataclasses.replace(design, sheets=sheets, fit=as_built(fit, sheets), notes=notes)


def _renumbered(notes: Sequence[str], numbers: Sequence[int]) -> Iterator[str]:
    """Yield notes with the seams of those sheets that are left, by their new numbers."""
    for note in notes:
        found = re.match(r"the seams? of sheets? ([\d, and]+) faces? (.*)", note)
        old = re.findall(r"\d+", found[1]) if found else ()
        now = [str(numbers.index(int(number)) + 1) for number in old if int(number) in numbers]
        if found is None:
            yield note
        elif now:
            several = "s" if len(now) > 1 else ""
            yield f"the seam{several} of sheet{several} {' and '.join(now)} face{'' if several else 's'} {found[2]}"


def design_robot(
    robot: str | Path,
    folder: str | Path,
    wires: int | None = None,
    *,
    share: float | None = None,
    options: DesignOptions | None = None,
    packages: Mapping[str, str | Path] | None = None,
    arguments: Mapping[str, str] | None = None,
    files: FileOptions | None = None,
    pictures: bool = True,
    replace: bool = False,
    progress: Callable[[str], None] = lambda _: None,
    **search: Any,
) -> RobotDesign:
    """Design all links of a URDF, and write those sheets that the wires allow, a folder for each link.

    Args:
        robot: a URDF or xacro file.
        folder: to write.
        wires: at most; None for as many as it takes.
        share: of the area that can be touched on all sheets that are possible: as few sheets as reach it are written;
            None, and no wires, for all of them.
        options, packages, arguments, files, pictures, replace, progress, search: as those of ``design_link``.

    Raises:
        MeshError: the file or the mesh of a link cannot be read, or the joints are no tree.
        GeometryError: no link can carry a sheet, wires are fewer than those of a sheet, or given with a share, which is
            above 0 and at most 1, or the folder is in use; nothing is written then.
        MissingExtra: as ``design_link``.
    """
    if wires is not None and wires < _WIRES_PER_SHEET:
        raise GeometryError(f"wires must be at least {_WIRES_PER_SHEET}, which a sheet has, got {wires}")
    if share is not None and not (wires is None and 0.0 < share <= 1.0):
        raise GeometryError(f"a share is above 0 % and at most 100 %, and excludes wires, got {100.0 * share:g} %")
    options = options or DesignOptions()
    check_target(Path(folder), replace)
    require_nesting()  # before the search, which takes a minute
    meshes: dict[str, Mesh] = {}
    found: dict[str, LinkDesign] = {}
    reasons: list[str] = []
    joints = urdf_joints(robot, packages, arguments)
    for name in urdf_links(robot, packages, arguments):
        link = f"{robot}#{name}"
        try:
            source, fit = _fit_link(link, None, packages, progress, arguments, **(room_for(options) | search))
        except MeshError as error:
            why = "every link is read for what moves beside it: mend it, or name its package (--package NAME=DIR)"
            raise MeshError(f"{link}: {error}; {why}") from error
        meshes[name] = source.mesh
        if fit.sheets:
            found[name] = LinkDesign(name, (), fit, source.mesh, source.frame, source.notes)
        else:
            reasons.append(f"{name} carries none: {fit.reason}")
    beside: dict[str, list[SphereBody]] = {}
    skins: dict[str, LinkDesign] = {}
    for name, design in found.items():
        beside[name] = list(_swept_beside(name, joints, meshes, skins).values())
        progress(f"{name}: placing sheets, tabs and cables beside what moves")
        sheets = () if design.fit is None else design.fit.sheets
        cleared = [_clear(sheet, options.stack.thickness, beside[name]) for sheet in sheets]
        left = {number: one for number, one in enumerate(cleared, 1) if one is not None}
        found[name] = skins[name] = _assembled(design, left, options, beside[name])
        if any(one is not sheet for one, sheet in zip(cleared, sheets, strict=True)):
            shortened = "its sheets are shortened to clear the next link"
            none = f"carries none: less than {1e3 * _LEAST_SLANT:g} mm of a sheet are clear of the next link"
            reasons.append(f"{name}: {shortened}" if found[name].sheets else f"{name} {none}")
        reasons += [f"{name}: {why}" for why in found[name].notes if why not in design.notes]
    progress("looking at what can be touched")
    sizes = _touchable(found, joints, meshes)
    offered: list[_Offer] = []
    for area, active, name, number in sorted(sizes, key=lambda size: -size[0]):
        total = area + (offered[-1].total if offered else 0.0)
        offered.append(_Offer(name, number, active, area, _WIRES_PER_SHEET * (len(offered) + 1), total))
    included = len(offered) if wires is None else min(len(offered), wires // _WIRES_PER_SHEET)
    if share is not None and offered:
        enough = share * (1.0 - 1e-9) * offered[-1].total  # as a sum, all of it may round to less
        included = next(count for count, one in enumerate(offered, 1) if one.total >= enough)
    if not offered:
        raise GeometryError(f"{robot}: no link can carry a sheet: {'; '.join(reasons)}")
    chosen: dict[str, LinkDesign] = {}
    for name, design in found.items():
        wanted = {one.number for one in offered[:included] if one.link == name}
        if len(wanted) < len(design.sheets):
            places = {k: kept for k, one in enumerate(design.sheets, 1) if k in wanted and (kept := one.found)}
            design = _assembled(design, places, options, beside[name])
        if design.sheets:
            chosen[name] = design
    progress("laying the cables")
    on_links = [(name, sheet) for name, design in chosen.items() for sheet in design.sheets]
    tree = CableRouter(joints, meshes, on_links, lambda link: _swept_beside(link, joints, meshes, chosen)).tree()
    with _new_folder(Path(folder), replace) as draft:
        result = RobotDesign(tuple(offered), included, tuple(reasons), tree)
        built: list[_BuiltSheet] = []
        for name, design in chosen.items():
            skin = tuple(_with_leads(sheet, tree.ohms(k)) for k, sheet in enumerate(design.sheets, len(built)))
            design = dataclasses.replace(design, sheets=skin)
            figures = _measured(skin, design.mesh, design.frame, len(built))
            design.written(
                draft / name,
                f"{robot}#{name}",
                options=files,
                pictures=pictures,
                progress=progress,
                first_sensor=len(built),
                figures=figures,
            )
            for sheet, item in zip(skin, figures, strict=True):
                built.append((name, dataclasses.replace(sheet, name=f"{name} {sheet.name}"), item))
        progress("drawing and writing what holds for the robot")
        if pictures:
            from .link_picture import draw_robot
            from .pictures import _draw_file, draw_curve

            poses = link_poses(joints, [min(max(0.0, joint.lower), joint.upper) for joint in joints])
            links = [mesh.moved(poses.get(name, Pose())) for name, mesh in meshes.items()]
            drawn = [
                dataclasses.replace(sheet, place=sheet.place.moved(poses.get(name, Pose()))) for name, sheet, _ in built
            ]
            lines = [
                np.concatenate(
                    [poses.get(part.place, Pose()).apply_all(part.points) for part in sections if not part.limits]
                )
                for sections in tree.cables
                if sections
            ]
            _draw_file(draft / "robot.png", (10, 9), draw_robot, links, drawn, lines)
            names = [f"{one.link} {one.number}" for one in offered]
            steps = [(one.wires, one.total) for one in offered]
            _draw_file(draft / "curve.png", (8, 4.5), draw_curve, steps, names, included)
        _write_robot(draft, result, built, str(robot), files or FileOptions(), pictures)
    return result


def _with_leads(sheet: SheetDesign, ohms: float) -> SheetDesign:
    """Return a sheet whose wires have a further resistance, as far as its board [ohm]."""
    leads = LeadOhms(*(lead + ohms for lead in sheet.electronics.lead_ohms))
    return dataclasses.replace(sheet, electronics=dataclasses.replace(sheet.electronics, lead_ohms=leads))


def _clear(fit: FittedSheet, thickness: float, beside: Sequence[SphereBody]) -> FittedSheet | None:
    """Return a sheet that ends before what moves beside it; None where too little is left."""
    side = fit.placed.frustum
    u = np.linspace(0.0, side.slant, max(2, math.ceil(side.slant / _SWEEP_ROW)) + 1)
    points, normals = fit.placed.place(*np.meshgrid(u, np.linspace(0.0, side.wrap, 121), indexing="ij"))
    met = np.zeros(len(u), bool)
    for height in (0.0, 0.5 * thickness, thickness):
        layer = (points + height * normals).reshape(-1, 3)
        for body in beside:
            met |= body.near(layer, _SWEEP_CLEARANCE).reshape(len(u), -1).any(axis=1)
    if not met.any():
        return fit
    first, end = longest_run(~met)
    if end == first or u[end - 1] - u[first] < _LEAST_SLANT:
        return None
    part = fit.placed.part(float(u[first]), float(u[end - 1]), 0.0, side.wrap)
    return fit.covering(part)


def _touchable(
    links: Mapping[str, LinkDesign], joints: Sequence[UrdfJoint], meshes: Mapping[str, Mesh]
) -> list[tuple[float, float, str, int]]:
    """Return of each sheet what can be touched of its active area, that area [m2], its link and its number."""
    chance = np.random.default_rng(1)
    free: dict[tuple[str, int], list[float]] = {}
    for _ in range(_POSE_COUNT):
        poses = link_poses(joints, [float(chance.uniform(joint.lower, joint.upper)) for joint in joints])
        shown = [mesh.moved(poses.get(name, Pose())) for name, mesh in meshes.items()]
        starts = np.cumsum([0, *(len(mesh.vertices) for mesh in shown)])
        faces = np.concatenate([mesh.faces + start for mesh, start in zip(shown, starts, strict=False)])
        rays = RayCaster(Mesh(np.concatenate([mesh.vertices for mesh in shown]), faces))
        for name, link in links.items():
            for number, sheet in enumerate(link.sheets, 1):
                box, pose = sheet.layout.active, poses.get(name, Pose())
                grid = (
                    np.linspace(low, high, count)
                    for low, high, count in zip((box.u1, box.phi1), (box.u2, box.phi2), _TOUCH_GRID, strict=True)
                )
                points, normals = (part.reshape(-1, 3) for part in sheet.outer_face(*np.meshgrid(*grid, indexing="ij")))
                turned = normals @ np.array(pose.rotation).T
                share = float(free_shares(pose.apply_all(points), turned, rays).mean())
                free.setdefault((name, number), []).append(share)
    sizes = []
    for (name, number), shares in free.items():
        layout = links[name].sheets[number - 1].layout
        active = layout.active.area(layout.sheet)
        sizes.append((active * math.fsum(shares) / len(shares), active, name, number))
    return sizes


def _write_robot(
    folder: Path, design: RobotDesign, built: Sequence[_BuiltSheet], robot: str, files: FileOptions, pictures: bool
) -> None:
    """Write what holds for the robot: its report, its parts on beds together, its cables, and the list of its files."""
    draft = _Draft(folder)
    sheets, figures = [sheet for _, sheet, _ in built], [item for _, _, item in built]
    beds, larger = _nested(sheets, files)
    for bed in beds:
        draft.write_drawing(Path("nested") / bed.slug, bed.sheets, bed.slug, files)
    rows = []
    for count, one in enumerate(design.offered, 1):
        areas = f"{1e4 * one.active:.1f}", f"{1e4 * one.area:.1f}", f"{1e4 * one.total:.1f}"
        rows.append((str(one.wires), one.link, str(one.number), *areas, "yes" if count <= design.included else "no"))
    guides = []
    for number, (link, sheet, _) in enumerate(built):
        connector = f"{in_mm(sheet.way.connector_length)} from {side_name(sheet.way.side)}"
        connector += ", on what is bolted to the link there" if sheet.way.hangs else ""
        guides.append((str(number), sheet.name, f"[report]({link}/report.md)", connector))
    head = "wires", "link", "sheet", "active [cm2]", "touchable [cm2]", "with all before [cm2]", "included"
    robot_picture = "![The robot with its sheets and cables from two sides.](robot.png)"
    curve = "![Touchable area against wires; what is included is filled.](curve.png)"
    lines = [
        f"# Skin of {Path(robot).name}",
        "",
        f"{design.included} sheets, {_WIRES_PER_SHEET * design.included} wires, with "
        f"{design.offered[design.included - 1].total / design.offered[-1].total:.0%} of what all {len(design.offered)} "
        "sheets that are possible would feel. Touchable is the active area times the "
        f"share of the half-space above it that the robot leaves free, over {_POSE_COUNT} poses drawn from its joints.",
        "",
        *_table(head, rows),
        *(("", robot_picture, "", curve) if pictures else ()),
        "",
        *(f"* {reason}" for reason in (*design.reasons, *larger)),
        *("", "## Everything to buy or to cut", ""),
        "For all sheets together; each report has the list of its link.",
        "",
        *_table(("item", "quantity", "for"), [*bill_of_materials(sheets, figures, beds), *_cable_items(design.cables)]),
        *("", "## Order of work", ""),
        "Cut all parts, finish every sheet on the bench, then wrap link after link in this order, each by its guide.",
        "",
        *_table(("sensor number", "sheet", "guide", "connector, along the cable"), guides),
        *("", "## Boards and cables", ""),
        *_cable_section(design.cables, sheets),
        *("", "## Yours to decide", ""),
        "* How you guide the loops, so that they catch nothing. They were not checked against what passes by.",
        "* Where the box stands. A board on its link would need a USB cable past each joint.",
        "* Whether links two joints away, or what slides, come to a sheet or a cable: this was not looked at. Sheets, "
        "tabs, ties and cables are clear of the links beside theirs, over the whole range of the joint between, and "
        "sheets of each other.",
    ]
    (folder / "report.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    written = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    links = list(dict.fromkeys(link for link, _, _ in built))
    data = {"robot": robot, "links": links, "cables": design.cables.as_data(), "files": [*written, DESIGN_FILE]}
    (folder / DESIGN_FILE).write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")


def _cut(length: float) -> float:
    """Return the length to which a cable is cut, with what its ends take [m]."""
    return math.ceil((length + 2.0 * _END_LENGTH) / _CUT_STEP - 1e-9) * _CUT_STEP


def _cable_items(tree: CableTree) -> list[tuple[str, str, str]]:
    """Return what the cables need: item, quantity, what it is for."""
    lengths = {sensor: _cut(tree.length(sensor)) for sensor, cable in enumerate(tree.cables) if cable}
    if not lengths:
        return []
    on_links = math.fsum(section.length for section, _ in tree.bundles() if section.limits is None)
    loops = sum(section.limits is not None for section, _ in tree.bundles())
    each = ", ".join(f"sensor {sensor}: {length:.2f} m" for sensor, length in lengths.items())
    return [
        ("cable of four stranded wires 0.14 mm2, at most 4 mm thick", f"{sum(lengths.values()):.2f} m in all", each),
        ("label with a sensor number", f"{2 * len(lengths)}", "both ends of each cable"),
        (
            "self-adhesive cable-tie mount and cable tie",
            f"{math.ceil(on_links / _TIE_STEP) + 2 * loops}",
            "cables on bare links, and both ends of each loop",
        ),
        ("board of `coneskin firmware`, and a box for all", f"{len(tree.cables)}", "a board for each sheet"),
    ]


def _cable_section(tree: CableTree, sheets: Sequence[SheetDesign]) -> Iterator[str]:
    """Yield the lines on boards and cables."""
    yield "All boards sit in one box at the foot of the robot, so no USB cable passes a joint. The four wires of each"
    yield "sheet run as one cable from its connector to the box. Mark both of its ends with the sensor number."
    yield ""
    rows = []
    for sensor, cable in enumerate(tree.cables):
        joints = ", ".join(section.place for section in cable if section.limits) or "none"
        length = f"{_cut(tree.length(sensor)):.2f}"
        own = [length, joints, f"{tree.ohms(sensor):.2f}"] if cable else ["yours to lay", "", ""]
        rows.append([str(sensor), sheets[sensor].name, *own])
    yield from _table(("sensor number", "sheet", "cable [m]", "joints passed", "each wire [ohm]"), rows)
    yield ""
    yield f"Cut them to these lengths: {in_mm(BOX_LENGTH)} lead from the foot to the box, {in_mm(_END_LENGTH)} are for"
    yield "each end. `lead_ohm` in `sensor.toml` has the ohms, and 1 ohm for the switch on the board."
    yield "Cables that go the same way are tied together. On a link the longest of them is given."
    yield ""
    rows = []
    for section, sensors in tree.bundles():
        over = "past" if section.limits == (0.0, 0.0) else "loop past"
        what = f"{over} {section.place}" if section.limits else section.place
        wires = f"{len(sensors)}, {_WIRES_PER_SHEET * len(sensors)}"
        numbers = ", ".join(map(str, sensors))
        rows.append([what, in_mm(section.length), numbers, wires, in_mm(2.0 * bundle_radius(len(sensors)))])
    yield from _table(("where", "length", "sensor numbers", "cables, wires", "bundle's diameter"), rows)
    yield ""
    yield f"* Fix the cables every {in_mm(_TIE_STEP)}, with mounts on a link, with tape on a sheet."
    yield "* Over a sheet they lie only where nothing senses, as beside its seam. `design.json` has the ways."
    yield "* No tie goes around a sheet. It would press as a touch does."
    yield "* A loop hangs slack while its joint is in the middle of the range. At both ends of the range it lies around"
    yield f"  the joint, one way or the other. Fix both its ends, and bend it no tighter than {in_mm(BEND_RADIUS)}."
    yield "* These cables have no pairs: at J1 of each board join E and S of each electrode. `board.md` of `coneskin"
    yield "  firmware` has a cable of pairs, for a board beside its sheet."
    yield "* Press each sheet once all are connected. `coneskin doctor` names the sensor: no two cables are exchanged."
    for section, _ in tree.bundles():
        yield from _winding(section)
    yield from (f"* {reason}" for reason in tree.reasons)


def _winding(section: CableSection) -> Iterator[str]:
    """Yield what a joint that turns by more than half a turn each way does to its loop."""
    lower, upper = section.limits or (0.0, 0.0)
    if math.isinf(upper - lower):
        yield f"* {section.place} has no limits. Its loop is for +-180 deg: set these limits in the controller."
    elif upper - lower > math.tau + 1e-6:
        turn = f"{math.degrees(upper - lower):.0f} deg"
        shorter = in_mm(float(loop_length(section.points[0], section.points[1], (-math.pi, math.pi))))
        yield f"* {section.place} turns by {turn} and winds its cables up. Limits of +-180 deg in the controller"
        yield f"  would shorten the loop to {shorter}."
