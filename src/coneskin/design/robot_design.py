"""Design of the skin of a whole robot: the sheets of all its links that one budget of wires buys.

Each link is designed as one alone is. Where a link that moves beside it comes in the way, its sheets end before. Every
sheet costs four wires, so the sheets that sense on most area come first: that is the most for each number of wires.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from coneskin.core.errors import GeometryError, MeshError
from coneskin.geometry.pose import Pose
from coneskin.geometry.ray_casting import RayCaster
from coneskin.geometry.urdf import UrdfJoint, urdf_joints, urdf_links

from .folder import DESIGN_FILE, FileOptions, _new_folder, write_design
from .link_design import LinkDesign, design_link, load_link
from .sheets.cable_way import SheetBody
from .sheets.sheet_design import DesignOptions, SheetDesign, design_assembly

if TYPE_CHECKING:
    from coneskin.geometry.fit.fitted_sheet import FittedSheet
    from coneskin.geometry.mesh import Mesh

_WIRES_PER_SHEET = 4
_SWEEP_STEP = math.radians(10.0)
_SWEEP_CLEARANCE = 3e-3  # m; of a sheet from what moves beside it
_LEAST_SLANT = 0.03  # m; a shorter rest of a sheet is not offered


class _Offer(NamedTuple):
    """A sheet that can be bought, after those before it."""

    link: str
    number: int  #: on that link
    area: float  #: active [m2]
    wires: int  #: with all before
    total: float  #: active area with all before [m2]


@dataclass(frozen=True, slots=True)
class RobotDesign:
    """The skin of a robot.

    Attributes:
        offered: all sheets, in the order in which they are bought: the curve of active area against wires.
        bought: how many of them the wires buy.
        reasons: why a link carries none, or its sheets are shortened; one sentence each.
    """

    offered: tuple[_Offer, ...]
    bought: int
    reasons: tuple[str, ...]


def design_robot(
    robot: str | Path,
    folder: str | Path,
    wires: int | None = None,
    *,
    options: DesignOptions | None = None,
    packages: Mapping[str, str | Path] | None = None,
    arguments: Mapping[str, str] | None = None,
    files: FileOptions | None = None,
    pictures: bool = True,
    replace: bool = False,
    progress: Callable[[str], None] = lambda _: None,
    **search: Any,
) -> RobotDesign:
    """Design all links of a URDF, and write those sheets that the wires buy, a folder for each link.

    Args:
        robot: a URDF or xacro file.
        folder: to write.
        wires: at most; None for all sheets.
        options, packages, arguments, files, pictures, replace, progress, search: as those of ``design_link``.

    Raises:
        MeshError: the file cannot be read.
        GeometryError: no link can carry a sheet, the wires buy none, or the folder is in use; nothing is written then.
    """
    options = options or DesignOptions()
    found: dict[str, LinkDesign] = {}
    reasons: list[str] = []
    meshes: dict[str, Mesh] = {}
    for name in urdf_links(robot, packages, arguments):
        link = f"{robot}#{name}"
        try:
            meshes[name] = next(load_link(link, None, packages, arguments)).mesh
            design = design_link(
                link, options=options, packages=packages, arguments=arguments, progress=progress, **search
            )
        except MeshError as error:
            reasons.append(f"{name}: {error}")
        except GeometryError as error:
            reasons.append(f"{name} carries none: {error}")
        else:
            found[name] = design
    joints = urdf_joints(robot, packages, arguments)
    for name, design in list(found.items()):
        progress(f"{name}: sweeping the joints beside it")
        swept = _swept(name, joints, meshes)
        kept = [_clear(sheet.fit, options.stack.thickness, swept) for sheet in design.sheets if sheet.fit is not None]
        if any(one is not sheet.fit for one, sheet in zip(kept, design.sheets, strict=True)):
            reasons.append(f"{name}: its sheets end before what moves beside it")
            sheets = _assembled(design, [one for one in kept if one is not None], options)
            found[name] = dataclasses.replace(design, sheets=sheets)
    sizes = [
        (sheet.layout.active.area(sheet.layout.sheet), name, number)
        for name, design in found.items()
        for number, sheet in enumerate(design.sheets, 1)
    ]
    offered: list[_Offer] = []
    for area, name, number in sorted(sizes, key=lambda size: -size[0]):
        total = area + (offered[-1].total if offered else 0.0)
        offered.append(_Offer(name, number, area, _WIRES_PER_SHEET * (len(offered) + 1), total))
    bought = len(offered) if wires is None else min(len(offered), wires // _WIRES_PER_SHEET)
    if not bought:
        raise GeometryError(
            f"{robot}: {len(offered)} sheets are possible, and {wires} wires buy none: a sheet has {_WIRES_PER_SHEET}. "
            + "; ".join(reasons)
        )
    with _new_folder(Path(folder), replace) as draft:
        result = RobotDesign(tuple(offered), bought, tuple(reasons))
        links, sensors = [], 0
        for name, design in found.items():
            sheets = design.sheets
            wanted = {one.number for one in offered[:bought] if one.link == name}
            if not wanted:
                continue
            fits = [sheet.fit for number, sheet in enumerate(sheets, 1) if number in wanted and sheet.fit is not None]
            chosen = sheets if len(wanted) == len(sheets) else _assembled(design, fits, options)
            fits = [sheet.fit for sheet in chosen if sheet.fit is not None]
            fit = None if design.fit is None else dataclasses.replace(design.fit, sheets=tuple(fits), bare_areas=())
            write_design(
                draft / name,
                chosen,
                fit=fit,
                mesh=design.mesh,
                title=name,
                source=f"{robot}#{name}",
                frame=design.frame,
                notes=design.notes,
                options=files,
                pictures=pictures,
                progress=progress,
                first_sensor=sensors,
            )
            sensors += len(chosen)
            links.append(name)
        _write_robot(draft, result, links, str(robot), pictures)
    return result


def _assembled(design: LinkDesign, fits: Sequence[FittedSheet], options: DesignOptions) -> tuple[SheetDesign, ...]:
    """Return the sheets of a link that has some of its places only, or shorter ones."""
    if design.fit is None or not fits:
        return ()
    return design_assembly(
        dataclasses.replace(design.fit, sheets=tuple(fits)), dataclasses.replace(options, link=design.name), design.mesh
    )[0]


def _swept(link: str, joints: Sequence[UrdfJoint], meshes: Mapping[str, Mesh]) -> Any:
    """Return points of the links next to one in its frame [m], shape (n, 3), over the ranges of the joints between."""
    from coneskin.geometry.fit.surface_samples import sample_surface

    clouds = [np.zeros((0, 3))]
    for joint in joints:
        other = {joint.parent: joint.child, joint.child: joint.parent}.get(link)
        if other is None or other not in meshes:
            continue
        points = sample_surface(meshes[other], RayCaster(meshes[other])).points
        steps = math.ceil((joint.upper - joint.lower) / _SWEEP_STEP)
        for angle in np.linspace(joint.lower, joint.upper, steps + 1):
            pose = joint.origin @ Pose.from_rotation_vector([float(angle) * x for x in joint.axis])
            clouds.append((pose if link == joint.parent else pose.inverse()).apply_all(points))
    return np.concatenate(clouds)


def _clear(fit: FittedSheet | None, thickness: float, swept: Any) -> FittedSheet | None:
    """Return a sheet that ends before what is swept; None where too little is left."""
    if fit is None:
        return None
    side = fit.placed.frustum
    hit = swept[SheetBody(fit.placed, thickness).near(swept, _SWEEP_CLEARANCE)]
    if not len(hit):
        return fit
    u = np.clip(fit.placed.locate_all(hit)[0], 0.0, side.slant)
    stops = np.unique(np.concatenate([[-_SWEEP_CLEARANCE], u, [side.slant + _SWEEP_CLEARANCE]]))
    widest = int(np.diff(stops).argmax())
    low, high = float(stops[widest]) + _SWEEP_CLEARANCE, float(stops[widest + 1]) - _SWEEP_CLEARANCE
    if high - low < _LEAST_SLANT:
        return None
    part = fit.placed.part(low, high, 0.0, side.wrap)
    share = part.frustum.area / side.area
    return dataclasses.replace(
        fit, placed=part, area_share=share * fit.area_share, length_share=share * fit.length_share
    )


def _write_robot(folder: Path, design: RobotDesign, links: Sequence[str], robot: str, pictures: bool) -> None:
    """Write what holds for the robot: the curve as table and picture, the reasons, and the list of its files."""
    rows = [("wires", "link", "sheet", "active area [cm2]", "with all before [cm2]", "bought")]
    for count, one in enumerate(design.offered, 1):
        areas = f"{1e4 * one.area:.1f}", f"{1e4 * one.total:.1f}"
        rows.append((str(one.wires), one.link, str(one.number), *areas, "yes" if count <= design.bought else "no"))
    lines = [
        f"# Skin of {Path(robot).name}",
        "",
        f"{design.bought} sheets, {_WIRES_PER_SHEET * design.bought} wires.",
        "",
    ]
    lines += ["| " + " | ".join(row) + " |" for row in (rows[0], ("---",) * 6, *rows[1:])]
    if pictures:
        from .pictures import draw_curve

        names = [f"{one.link} {one.number}" for one in design.offered]
        draw_curve(folder / "curve.png", [(one.wires, one.total) for one in design.offered], names, design.bought)
        lines += ["", "![Active area against wires; what is bought is filled.](curve.png)"]
    lines += ["", *(f"* {reason}" for reason in design.reasons)]
    lines += [f"* [{name}]({name}/report.md): how its sheets are built" for name in links]
    lines += ["* Not looked at: links two joints away, and what the skin of one link takes from another's range."]
    (folder / "report.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    files = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    data = {"robot": robot, "links": list(links), "files": [*files, DESIGN_FILE]}
    (folder / DESIGN_FILE).write_text(json.dumps(data, indent=2) + "\n", encoding="utf-8")
