"""Check of a report by hand: its numbers from the cut files and from formulas, with nothing of coneskin.

    python -m bench build-report DESIGN-FOLDER ...      # of round sheets, drawn with the defaults of `coneskin design`

Areas by the outlines in the DXF files, arcs included; holes by their centres there; ohms by the integral over rings and
rulings between the electrodes, over as much of the sheet as the DXF file has; wires by their way around the end. Sizes
and volumes of the jig as trimesh reads the STL files. Where the link of the design can be read: how far it stands out
beyond the planes of its flat faces, and the distances of the places of a sheet from these, by its radii and its pose.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import trimesh

STRIPPED, LOOP, CONTACT, STEP = 8.0, 20.0, 4.0, 5.0  # mm; as the guide says


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", metavar="DESIGN-FOLDER")
    for name in parser.parse_args().folders:
        folder = Path(name)
        data = json.loads((folder / "design.json").read_text())
        sheets, link = data["sheets"], _link(Path(data["link"]))
        for number, sheet in enumerate(sheets, 1):
            cut = folder / ("cut" if len(sheets) == 1 else f"sheet-{number}/cut")
            area = max(abs(1e-2 * _area(cut, layer) / layer["area_cm2"] - 1.0) for layer in sheet["layers"])
            holes = max(
                _hole_error(cut, layer, sheet) for layer in sheet["layers"] if "electrodes" not in layer["name"]
            )
            along, around = _ohms(cut, sheet)
            wires = max(abs(_length(sheet, wire) - wire["length_mm"]) for wire in sheet["cable"]["wires"])
            said = sheet["multimeter_ohm"]
            print(
                f"{folder.name} {sheet['name']}: areas within {area:.1e}, holes within {holes:.4f} mm, "
                f"A-B {said['A-B']:.1f} for {along:.1f} ohm, C-D {said['C-D']:.1f} for "
                f"{around:.1f} ohm, wires within {wires:g} mm"
            )
            print(f"  {_jig(folder if len(sheets) == 1 else folder / f'sheet-{number}', sheet)}")
            print(f"  {_faces(link, sheet)}")


def _outlines(cut: Path, layer: dict[str, Any], kind: str) -> list[list[tuple[float, float, float]]]:
    """Return the outlines of a part [mm], each as corners with the bulge of the arc that follows."""
    path = next(cut.glob(f"{layer['number']}-*.dxf"))
    found = ezdxf.readfile(path).modelspace().query("LWPOLYLINE")
    return [[(x, y, b) for x, y, *_, b in line.get_points()] for line in found if line.dxf.layer.endswith(kind)]


def _area(cut: Path, layer: dict[str, Any]) -> float:
    """Return the area of a part [mm2]: chords by the shoelace formula, arcs by their circular segments."""
    total = 0.0
    for line in _outlines(cut, layer, "_CUT"):
        signed = 0.0
        for (x, y, bulge), (p, q, _) in zip(line, line[1:] + line[:1], strict=True):
            turn, chord = 4.0 * math.atan(bulge), math.hypot(p - x, q - y)
            signed += 0.5 * (x * q - p * y)
            if bulge:
                signed += 0.5 * (0.5 * chord / math.sin(0.5 * turn)) ** 2 * (turn - math.sin(turn))
        total += abs(signed)
    return total - sum(
        math.pi / 4 * (max(x for x, _, _ in h) - min(x for x, _, _ in h)) ** 2 for h in _holes(cut, layer)
    )


def _holes(cut: Path, layer: dict[str, Any]) -> list[list[tuple[float, float, float]]]:
    return _outlines(cut, layer, "_HOLE")


def _flat(layer: dict[str, Any], u: float, phi_deg: float) -> tuple[float, float]:
    """Return where a place of the sheet lies on a flat part, seen from outside [mm]."""
    sine = math.sin(math.radians(layer["half_angle_deg"]))
    away = math.radians(phi_deg - 0.5 * layer["wrap_deg"])
    if abs(sine) < 1e-9:
        return layer["radius1_mm"] * away, u
    rho1 = layer["radius1_mm"] / sine
    return (rho1 + u) * math.sin(sine * away), (rho1 + u) * math.cos(sine * away) - rho1


def _hole_error(cut: Path, layer: dict[str, Any], sheet: dict[str, Any]) -> float:
    """Return the largest distance of a hole's centre in the file from its coordinates in the report [mm]."""
    side = -1.0 if layer["face_up"] == "inside" else 1.0
    wanted = [_flat(layer, hole["u_mm"], hole["phi_deg"]) for hole in sheet["holes"]]
    found = []
    for line in _holes(cut, layer):
        xs, ys = [x for x, _, _ in line], [y for _, y, _ in line]
        found.append((side * 0.5 * (min(xs) + max(xs)), 0.5 * (min(ys) + max(ys))))
    assert len(found) == len(wanted)
    return max(min(math.dist(hole, other) for other in found) for hole in wanted)


def _ohms(cut: Path, sheet: dict[str, Any]) -> tuple[float, float]:
    """Return the resistances A-B and C-D [ohm], of sheets as wide as their outlines are between the electrodes."""
    upper, lower = sheet["layers"][4], sheet["layers"][2]
    field, parts = sheet["field_patch"], sheet["electronics"]
    middle = 0.5 * (field["u1_mm"] + field["u2_mm"])
    phi1, phi2 = _span(cut, upper, middle, around=True)
    u1, u2 = _span(cut, lower, 0.5 * (field["phi1_deg"] + field["phi2_deg"]), around=False)
    along = _integral(upper, field["u1_mm"], field["u2_mm"]) / math.radians(phi2 - phi1)
    around = math.radians(field["phi2_deg"] - field["phi1_deg"]) / _integral(lower, u1, u2)
    return parts["upper_sheet_ohm"] * along, parts["lower_sheet_ohm"] * around


def _integral(layer: dict[str, Any], u1: float, u2: float) -> float:
    """Return the integral of du over the radius, by Simpson's rule on 2000 steps."""
    steps, slope = 2000, (layer["radius2_mm"] - layer["radius1_mm"]) / layer["slant_mm"]
    h = (u2 - u1) / steps
    weights = [1.0 if k in (0, steps) else 4.0 if k % 2 else 2.0 for k in range(steps + 1)]
    return float(h / 3.0 * sum(w / (layer["radius1_mm"] + slope * (u1 + k * h)) for k, w in enumerate(weights)))


def _span(cut: Path, layer: dict[str, Any], at: float, around: bool) -> tuple[float, float]:
    """Return where a line around at u [mm] crosses an outline [deg], or one along at phi [deg] does [mm]."""
    side = -1.0 if layer["face_up"] == "inside" else 1.0
    (line,) = _outlines(cut, layer, "_CUT")
    sine = math.sin(math.radians(layer["half_angle_deg"]))
    places = []
    for x, y, _ in line:
        if abs(sine) < 1e-9:
            u, away = y, side * x / layer["radius1_mm"]
        else:
            rho1 = layer["radius1_mm"] / sine
            rho = math.copysign(math.hypot(x, y + rho1), rho1)
            u, away = rho - rho1, math.asin(side * x / rho) / sine
        places.append((u, math.degrees(away) + 0.5 * layer["wrap_deg"]))
    found = []
    for one, two in zip(places, places[1:] + places[:1], strict=True):
        (a, p), (b, q) = (one, two) if around else (one[::-1], two[::-1])
        if min(a, b) <= at < max(a, b):
            found.append(p + (q - p) * (at - a) / (b - a))
    return min(found), max(found)


def _length(sheet: dict[str, Any], wire: dict[str, Any]) -> float:
    """Return the length of a wire [mm], around the bare end to the middle of the cable and on to its connector."""
    cable, cone = sheet["cable"], sheet["link_cone"]
    radius = cone["radius1_mm"] if cable["side"] == "end1" else cone["radius2_mm"]
    turn = abs((wire["phi_deg"] - cable["phi_deg"] + 180.0) % 360.0 - 180.0)
    length = STRIPPED + math.radians(turn) * radius + cable["connector_mm"] + LOOP + CONTACT
    return float(math.ceil(length / STEP - 1e-6) * STEP)


def _link(path: Path) -> np.ndarray | None:
    """Return the corners of a link's mesh [mm]; None where there is no file."""
    if not path.is_file():
        return None
    corners = np.asarray(trimesh.load_mesh(path).vertices, float)
    return corners * (1e3 if np.ptp(corners, axis=0).max() < 5.0 else 1.0)


def _jig(place: Path, sheet: dict[str, Any]) -> str:
    """Compare the parts of the jig with what the report says of them."""
    size = volume = 0.0
    parts = [part for collar in sheet["jig"] for part in collar["parts"]]
    if not parts:
        return "no jig"
    for part in parts:
        solid = trimesh.load_mesh(place / part["file"])
        assert solid.is_watertight
        assert solid.is_winding_consistent
        assert len(solid.split()) == 1
        assert abs(solid.bounds[0][2]) < 1e-3, "it stands on the printer's bed"
        size = max(size, float(np.abs(np.sort(solid.extents) - np.sort(part["size_mm"])).max()))
        volume = max(volume, abs(1e-3 * solid.volume / part["volume_cm3"] - 1.0))
    return f"jig: {len(parts)} parts, each one closed solid, sizes within {size:.4f} mm, volumes within {volume:.1e}"


def _faces(link: np.ndarray | None, sheet: dict[str, Any]) -> str:
    """Compare the faces and the distances from them with the link's mesh and the pose of the sheet."""
    faces, cone = sheet["placement"]["faces"], sheet["link_cone"]
    if not faces or link is None:
        return "no flat faces"
    normals = np.array([face["normal"] for face in faces])
    offsets = np.array([face["offset_mm"] for face in faces])
    beyond = (link @ normals.T).max(axis=0) - offsets
    angles = np.radians(cone["rpy_deg"])[::-1]  # yaw, pitch, roll
    turns = [
        trimesh.transformations.rotation_matrix(a, d)[:3, :3] for a, d in zip(angles, np.eye(3)[::-1], strict=True)
    ]
    rotation = turns[0] @ turns[1] @ turns[2]
    worst = 0.0
    for row in sheet["placement"]["heights"]:
        if sheet.get("bends") and row["phi_deg"]:
            continue  # its radii are arc over wrap: they place edge 0 only
        share, phi = row["u_mm"] / cone["slant_mm"], math.radians(row["phi_deg"])
        radius = cone["radius1_mm"] + share * (cone["radius2_mm"] - cone["radius1_mm"])
        local = np.array([radius * math.cos(phi), radius * math.sin(phi), share * cone["height_mm"]])
        heights = offsets - normals @ (rotation @ local + cone["xyz_mm"])
        worst = max(worst, float(np.abs(heights - row["from_faces_mm"]).max()))
    return (
        f"faces {', '.join(face['name'] for face in faces)}: the link reaches {beyond.max():+.3f} mm beyond them, "
        f"{len(sheet['placement']['heights'])} places within {worst:.3f} mm"
    )
