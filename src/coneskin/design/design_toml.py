"""Options of a design in a file, ``design.toml``: one table of keys for the file, ``--set`` and the reference.

A key has the name of a field of ``DesignOptions`` and its parts, ``FileOptions`` or ``FitOptions``, with its unit, and
the default of that field.
"""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, get_args

from coneskin.core.errors import GeometryError, SceneError
from coneskin.core.keys import Key, check, with_meanings
from coneskin.core.text import suggest
from coneskin.geometry.drawing.cut_sheet import FaceUp
from coneskin.geometry.drawing.dxf import ArcStyle
from coneskin.geometry.drawing.electrode_layout import ElectrodePlan
from coneskin.geometry.drawing.layer_stack import PAPER_STACK, AssemblyMode, LayerStack
from coneskin.geometry.drawing.pdf import PageSize
from coneskin.geometry.drawing.surface_shape import SheetSide
from coneskin.scene.tables.keys import MAX_SIZE
from coneskin.scene.tables.sensor_keys import SENSOR_KEYS
from coneskin.scene.tables.sensor_tables import read_toml
from coneskin.skin.electronics import GivenElectronics

from .folder import FileOptions
from .sheets.sheet_design import DesignOptions, JigPlan, JigSurface

_DEFAULT_OPTIONS, _DEFAULT_FILES, _PAPER_LAYERS = DesignOptions(), FileOptions(), PAPER_STACK.layers
_GIVEN_ELECTRONICS = ("supply_v", "adc_v", "adc_bits", "pulldown_ohm", "current_full_scale_ma")
_GIVEN_SHEETS = ("upper_sheet_ohm", "lower_sheet_ohm")  # they have a default in a scene, and none in a design


def _fields(text: str, owner: object, *keys: Key) -> tuple[Key, ...]:
    """Return keys with their meanings, and with the types and the defaults of the fields of a dataclass."""
    found = []
    for key in keys:
        default = getattr(owner, key.plain if key.kind is float else key.name.removesuffix("_mm"))
        kind = key.kind if default is None or isinstance(default, tuple) else type(default)
        found.append(replace(key, kind=kind, default=default))
    return with_meanings(text, *found)


def _of_layers(key: Key) -> Key:
    """Return the key of a field of the five layers, with the values of the paper."""
    return replace(key, default=tuple(getattr(layer, key.plain) for layer in _PAPER_LAYERS), length=5)


#: table of design.toml -> what it is about, and its keys
DESIGN_TABLES: Mapping[str, tuple[str, tuple[Key, ...]]] = {
    "search": (
        "Finding sheets in a mesh.",
        with_meanings(
            """
            tolerance_mm: largest distance between a sheet and the mesh
            max_sheets: largest number of sheets
            max_wires: largest number of wires, four for each sheet
            min_length_mm: smallest length of a sheet along its axis
            min_wrap_deg: smallest partial wrap
            max_bridge_mm: widest hole or groove that a sheet spans
            round_only: use cones only, no sides of another section
            allow_hull: accept a convex mesh of few faces. It is the link, no collision hull
            seam: direction X, Y, Z in which the seam faces, as the cable
            touch_side: side X, Y, Z on which touches are likely. The seam faces away from it
            weights: cover what counts: a CSV file with x_mm,y_mm,z_mm,weight of places
            exposure: cover what can be touched: areas count by the free space above them
            """,
            Key("tolerance_mm", default=1e-3, low=0.0, high=20.0, above=True),
            Key("max_sheets", int, 2, low=1, high=100),
            Key("max_wires", int, None, low=4, high=400, unset="any number"),
            Key("min_length_mm", default=0.025, low=0.0, above=True),
            Key("min_wrap_deg", default=math.radians(150.0), low=0.0, high=360.0, above=True),
            Key("max_bridge_mm", default=0.010, low=0.0, high=100.0, above=True),
            Key("round_only", bool, False),
            Key("allow_hull", bool, False),
            Key("seam", list, None, length=3, unset="where the link shields it most"),
            Key("touch_side", list, None, length=3, unset="none"),
            Key("weights", str, None, unset="all areas count the same"),
            Key("exposure", bool, False),
        ),
    ),
    "layers": (
        "From the link outwards: lower substrate, lower conductive, isolation, upper conductive, upper substrate.",
        with_meanings(
            """
            thickness_mm: thicknesses
            material: names of the materials
            neutral_factor: K-factors, 0 for the inner to 1 for the outer face
            stiffness_mpa: Young's moduli
            assembly: layers glued together flat, before wrapping: none (loose), each conductive sheet to its substrate
                (pairs), or all (bonded)
            """,
            _of_layers(Key("thickness_mm", list, low=0.0, high=20.0, above=True)),
            _of_layers(Key("material", tuple)),
            _of_layers(Key("neutral_factor", list, low=0.0, high=1.0)),
            _of_layers(Key("stiffness_mpa", list, low=0.0, above=True)),
            Key("assembly", str, PAPER_STACK.assembly, choices=get_args(AssemblyMode)),
        ),
    ),
    "electrodes": (
        "Widths on the sheet. Without this table they are chosen for each sheet, so that most of it is active.",
        _fields(
            """
            margin_mm: inactive rim outside the electrodes
            electrode_mm: width of the electrodes
            setback_mm: distance of the conductive sheets from the rim
            lead_mm: width of leads and tabs
            clearance_mm: distance between leads and other foil
            tab_mm: length of the tabs beyond the rim, 0 for none
            hole_mm: diameter of the registration holes, 0 for none
            """,
            ElectrodePlan(),
            *(Key(f"{name}_mm", low=0.0) for name in ("margin", "electrode", "setback", "lead", "clearance")),
            *(Key(f"{name}_mm", low=0.0) for name in ("tab", "hole")),
        ),
    ),
    "sheet": (
        "Seam, wires and neighbors.",
        _fields(
            """
            wires: side where all four wires leave
            connector_mm: way from the rim to the wires' connector, shorter where there is no room
            seam_gap_mm: gap of the seam of a full wrap
            overlap_mm: width of a flap of the upper substrate over the seam
            cover_seam: close the blind seam of each full wrap by a strip, a sensor on top
            sheet_gap_mm: smallest distance between neighboring sheets
            """,
            _DEFAULT_OPTIONS,
            Key("wires", str, choices=get_args(SheetSide), unset="where they find room"),
            Key("connector_mm", low=30.0, high=2000.0),
            Key("seam_gap_mm", low=0.0),
            Key("overlap_mm", low=0.0),
            Key("cover_seam"),
            Key("sheet_gap_mm", low=0.0),
        ),
    ),
    "drawings": (
        "Files for the cutter and the printer.",
        (
            *_fields(
                """
                kerf_mm: width of the cut
                face_up: face that is up in the drawings. work is the one on which the next part is glued
                """,
                _DEFAULT_OPTIONS,
                Key("kerf_mm", low=0.0),
                Key("face_up", choices=get_args(FaceUp)),
            ),
            *_fields(
                """
                tolerance_mm: tolerance of flattened arcs, and of patterns cut as rectangles
                arcs: style of arcs in DXF files
                page: paper size of the PDF files
                bed_mm: width and depth of the cutter's bed, on which parts are nested
                bed_gap_mm: gap between nested parts
                step: write the wrapped layers as a STEP file too (extra cad)
                """,
                _DEFAULT_FILES,
                Key("tolerance_mm", low=1e-4, high=1.0),
                Key("arcs", choices=get_args(ArcStyle)),
                Key("page", choices=get_args(PageSize)),
                Key("bed_mm", list, low=50.0, high=10_000.0, length=2),
                Key("bed_gap_mm", low=0.0, high=100.0),
                Key("step"),
            ),
        ),
    ),
    "jig": (
        "Printed collars that hold the ends of a sheet at their places.",
        _fields(
            """
            surface: what the collars lie on: the link's own surface, or its cone where there is no mesh (link), always
                the cone (cone); or no jig (none)
            wall_mm: thickness of the wall
            clearance_mm: gap to link and sheet
            reach_mm: length over the sheet
            grip_mm: length on the link
            parts: parts of a collar
            """,
            _DEFAULT_OPTIONS.jig,
            Key("surface", choices=get_args(JigSurface)),
            Key("wall_mm", low=1.5, high=20.0),
            Key("clearance_mm", low=0.0, high=3.0),
            Key("reach_mm", low=8.0, high=200.0),
            Key("grip_mm", low=4.0, high=100.0),
            Key("parts", low=2, high=8),
        ),
    ),
    "electronics": (
        "What you have already. The rest is chosen to match the sheets.",
        tuple(
            replace(key, default=None, unset="chosen to match the sheet") if key.name in _GIVEN_SHEETS else key
            for key in SENSOR_KEYS
            if key.name in (*_GIVEN_ELECTRONICS, *_GIVEN_SHEETS)
        ),
    ),
}
_EXAMPLE = "write TABLE.KEY=VALUE, as in --set drawings.kerf_mm=0.2"


@dataclass(frozen=True, slots=True)
class _DesignSettings:
    """Options of a design, of its files, and the keyword arguments of the search, as ``design_link`` takes them."""

    options: DesignOptions
    files: FileOptions
    search: Mapping[str, Any]


def read_settings(path: Path | None = None, words: Sequence[str] = ()) -> _DesignSettings:
    """Read the options of a design.

    Args:
        path: a file such as ``settings_text`` makes; None for the defaults.
        words: settings such as "drawings.kerf_mm=0.2", which go before those of the file.

    Raises:
        SceneError: the file cannot be read, or has mistakes; a line for each.
        GeometryError: a setting in the words is wrong.
    """
    values: dict[str, dict[str, Any]] = {name: {} for name in DESIGN_TABLES}
    if path is not None:
        problems: list[str] = []
        _add(values, read_toml(path, MAX_SIZE, "the options", problems), "", problems, path.parent)
        if problems:
            raise SceneError(problems, str(path))
    for word in words:
        problems = []
        _add(values, _setting(word), "--set ", problems, Path())
        if problems:
            raise GeometryError(problems[0])
    return _settings(values)


def _setting(word: str) -> dict[str, Any]:
    """Return the tables of one setting on the command line."""
    name, equals, text = word.partition("=")
    table, dot, key = name.strip().partition(".")
    if not (equals and dot and table and key and text.strip()):
        raise GeometryError(f"{_EXAMPLE}; got --set {word}")
    try:
        return {table: {key: tomllib.loads(f"value = {text}")["value"]}}
    except (ValueError, RecursionError, KeyError):
        return {table: {key: text.strip()}}  # a word without quotation marks


def _add(
    values: dict[str, dict[str, Any]], tables: Mapping[str, Any], start: str, problems: list[str], folder: Path
) -> None:
    """Add the values of some tables in SI, under their plain names."""
    for name, table in tables.items():
        if name not in DESIGN_TABLES:
            owners = [other for other, (_, keys) in DESIGN_TABLES.items() if name in {key.name for key in keys}]
            hint = f"the key {name} belongs into the table {owners[0]}" if owners else suggest(name, DESIGN_TABLES)
            problems.append(f"{start}{name}: unknown table; {hint}")
        elif not isinstance(table, dict):
            problems.append(f"{start}{name} must be a table, [{name}], got {table!r}")
        else:
            keys = DESIGN_TABLES[name][1]
            found = check(table, keys, start + name, problems)
            values[name] |= {key.plain: found.get(key.plain) for key in keys if key.name in table}
            if name == "search" and isinstance(table.get("weights"), str):
                values[name]["weights"] = folder / table["weights"]


def _settings(values: Mapping[str, Mapping[str, Any]]) -> _DesignSettings:
    """Return the options that checked values describe; those that are missing have the defaults of their fields."""
    layers = dict(values["layers"])
    mode = layers.pop("assembly", PAPER_STACK.assembly)
    one, two, three, four, five = (
        replace(layer, **{name: five[i] for name, five in layers.items()}) for i, layer in enumerate(PAPER_STACK.layers)
    )
    drawings = dict(values["drawings"])
    tolerance = drawings.get("tolerance", _DEFAULT_FILES.tolerance)
    of_options = {name: drawings.pop(name) for name in ("kerf", "face_up") if name in drawings}
    given = dict(values["electronics"])
    ohms = {f"{name}_ohms": given.pop(name) for name in ("upper_sheet", "lower_sheet") if name in given}
    fields = {"supply": "supply_volts", "adc": "adc_volts", "pulldown": "pulldown_ohms"}
    options = DesignOptions(
        stack=LayerStack((one, two, three, four, five), mode),
        plan=ElectrodePlan(**values["electrodes"]) if values["electrodes"] else None,
        electronics=GivenElectronics(**{fields.get(name, name): value for name, value in given.items()}),
        jig=JigPlan(**values["jig"]),
        snap=tolerance,
        **values["sheet"],
        **of_options,
        **ohms,
    )
    return _DesignSettings(options, FileOptions(**drawings), _search(values["search"]))


def _search(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments of the search; a seam and what areas count are given once."""
    search = {name: value for name, value in values.items() if value is not None}
    for name in ("seam", "touch_side"):
        if name in search and not math.hypot(*search[name]) > 0.0:
            raise GeometryError(f"search.{name} must be a direction X, Y, Z that is not 0, 0, 0")
    if "seam" in search and "touch_side" in search:
        raise GeometryError("search.seam and search.touch_side cannot go together: the seam faces away from touches")
    if "weights" in search and search.get("exposure"):
        raise GeometryError("search.weights and search.exposure cannot go together: areas count by one of them")
    if "weights" in search:
        from coneskin.geometry.fit.touch_weights import read_touch_weights

        search["weights"] = read_touch_weights(search["weights"])
    if "touch_side" in search:
        search["seam_direction"] = tuple(-value for value in search.pop("touch_side"))
    if "seam" in search:
        search["seam_direction"] = search.pop("seam")
    return search


def settings_text() -> str:
    """Return a file with every key, each commented out, with its default, its unit and its meaning."""
    return "\n".join(_lines()) + "\n"


def _lines() -> Iterator[str]:
    yield "# Options of a design: coneskin design LINK -o DIR --options design.toml"
    yield "# Every key has its default. Remove the # in front of those that you change."
    for name, (meaning, keys) in DESIGN_TABLES.items():
        yield from ("", f"# {meaning}", f"[{name}]")
        for key in keys:
            unit = "" if key.kind in (bool, str, tuple) else f" [{key.unit}]"
            bounds = f" {'Choices' if key.choices else 'Range'}: {key.bounds}." if key.bounds else ""
            missing = f" Default: {key.default_words}." if key.default is None else ""
            yield f"# {key.meaning[0].upper()}{key.meaning[1:]}{unit}.{bounds}{missing}"
            yield f"#{key.name} = {_toml(key)}".rstrip()


def _toml(key: Key) -> str:
    """Return the default of a key as TOML, in its unit."""
    if key.default is None:
        return ""
    if key.kind in (list, tuple):
        return f"[{', '.join(_value(key, value) for value in key.default)}]"
    return _value(key, key.default)


def _value(key: Key, value: Any) -> str:
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False)
    return f"{key.in_file_unit(value):.10g}"
