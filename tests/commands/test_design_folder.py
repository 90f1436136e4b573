"""Folder of ``coneskin design``: a person's files in it stay, signals leave nothing, names may be no text."""

import itertools
import json
import math
import os
import shutil
import signal
import struct
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from coneskin import cli
from coneskin.cli import main
from coneskin.commands import design as command
from coneskin.design import folder as design_folder
from coneskin.design import link_design
from coneskin.design.link_design import LinkMesh
from coneskin.geometry.fit.axis_plan import FittedSheet
from coneskin.geometry.fit.cones import LinkFit
from coneskin.geometry.frustum import Frustum

CYLINDER = ["--radius1-mm", "54", "--height-mm", "200"]
Triangle = tuple[tuple[float, float, float], ...]


def design(*words: str) -> int:
    return main(["design", *words, "--no-pictures"])


def write_stl(path: Path, triangles: list[Triangle]) -> None:
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *(x for p in t for x in p), 0) for t in triangles)
    path.write_bytes(bytes(80) + struct.pack("<I", len(triangles)) + body)


def turned(profile: list[tuple[float, float]], sides: int = 72) -> Iterator[Triangle]:
    """Surface of revolution about z through (z, radius) [m]."""
    ring = [(math.cos(2 * math.pi * i / sides), math.sin(2 * math.pi * i / sides)) for i in range(sides + 1)]
    for (z0, r0), (z1, r1) in itertools.pairwise(profile):
        for (c, s), (d, t) in itertools.pairwise(ring):
            a, b, e, f = (r0 * c, r0 * s, z0), (r0 * d, r0 * t, z0), (r1 * c, r1 * s, z1), (r1 * d, r1 * t, z1)
            yield a, b, f
            yield a, f, e


@pytest.mark.long
def test_a_replaced_design_leaves_what_a_person_put_beside_it(tmp_path: Path, cylinder_design: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(cylinder_design, out)
    (out / "notes").mkdir()
    (out / "notes" / "thesis.tex").write_text("years of work")
    (out / "link").symlink_to(tmp_path)
    assert design(*CYLINDER, "--set", "sheet.wires=end2", "--force", "-o", str(out)) == 0
    assert (out / "notes" / "thesis.tex").read_text() == "years of work"
    assert (out / "link").is_symlink()
    listed = set(json.loads((out / "design.json").read_text())["files"])
    there = {path.relative_to(out).as_posix() for path in out.rglob("*") if not path.is_dir() and not path.is_symlink()}
    assert there - listed == {"notes/thesis.tex"}
    assert listed - there == set()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.long
def test_a_persons_file_is_not_overwritten(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], cylinder_design: Path
) -> None:
    out = tmp_path / "out"
    shutil.copytree(cylinder_design, out)
    (out / "sheet-1").mkdir()
    (out / "sheet-1" / "sensor.toml").write_text("mine")
    two = ["--radius3-mm", "40", "--height2-mm", "150"]
    assert design(*CYLINDER, *two, "--force", "-o", str(out)) == 1
    assert "sensor.toml is not of the earlier design, but of the new one: move it away" in capsys.readouterr().err
    assert (out / "sheet-1" / "sensor.toml").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("swallowed", [False, True])
@pytest.mark.long
def test_a_signal_ends_the_command_and_leaves_nothing(
    number: signal.Signals, code: int, swallowed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some libraries catch every exception, so that an interrupt does not arrive."""

    def drawing(*_: object) -> str:
        try:
            os.kill(os.getpid(), number)
        except BaseException:
            if not swallowed:
                raise
        return "drawing"

    before = [signal.getsignal(item) for item in (signal.SIGINT, signal.SIGTERM)]
    monkeypatch.setattr(design_folder, "to_dxf", drawing)
    try:
        ended = design(*CYLINDER, "-o", str(tmp_path / "out"))
    except SystemExit as exc:
        ended = int(str(exc.code))
    assert ended == code
    assert list(tmp_path.iterdir()) == []
    assert [signal.getsignal(item) for item in (signal.SIGINT, signal.SIGTERM)] == before


def test_an_interrupt_while_a_command_is_imported_has_no_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(_: str) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(cli.importlib, "import_module", interrupted)
    assert design(*CYLINDER, "-o", "out") == 130
    assert capsys.readouterr().err == "coneskin: interrupted\n"


@pytest.mark.long
def test_a_mesh_whose_name_is_no_text_is_designed(tmp_path: Path) -> None:
    """With LC_ALL=C, or from another computer, the bytes of a name may be no UTF-8."""
    mesh = tmp_path / os.fsdecode(b"\xe4rm.stl")
    write_stl(mesh, list(turned([(0.0, 0.05), (0.2, 0.05)])))
    words = ["--set", "layers.material=['weiß', 'Папір', 'net', 'paper', 'foam']"]
    assert design(str(mesh), *words, "-o", str(tmp_path / "out")) == 0
    assert "\\udce4rm" in (tmp_path / "out" / "report.md").read_text(encoding="utf-8")
    drawing = (tmp_path / "out" / "cut" / "1-lower-substrate.svg").read_text(encoding="utf-8")
    assert ">?rm: sheet 1<" in drawing
    assert ">weiss 2.50 mm<" in drawing
    assert design(str(mesh), "--set", 'layers.material=["a\\nb", "c", "d", "e", "f"]', "-o", str(tmp_path / "bad")) == 1


@pytest.mark.long
def test_a_package_of_a_urdf_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "urdf").mkdir()
    (tmp_path / "elsewhere" / "meshes").mkdir(parents=True)
    write_stl(tmp_path / "elsewhere" / "meshes" / "tube.stl", list(turned([(0.0, 0.05), (0.2, 0.05)])))
    mesh = '<geometry><mesh filename="package://my_arm/meshes/tube.stl"/></geometry>'
    urdf = tmp_path / "urdf" / "arm.urdf"
    urdf.write_text(f'<robot name="r"><link name="arm"><visual>{mesh}</visual></link></robot>')
    assert design(f"{urdf}#arm", "-o", str(tmp_path / "out")) == 1
    assert "--package my_arm=DIR" in capsys.readouterr().err
    package = f"my_arm={tmp_path / 'elsewhere'}"
    assert design(f"{urdf}#arm", "--package", package, "-o", str(tmp_path / "out")) == 0
    assert design(f"{urdf}#arm", "--package", "my_arm", "-o", str(tmp_path / "no")) == 1
    assert "--package takes NAME=DIR" in capsys.readouterr().err


@pytest.mark.long
def test_what_a_sheet_spans_is_said_beside_its_deviation(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A groove of 9 mm, 1.16 mm deep, is no deviation of at most 1 mm."""
    groove = [(0.0, 0.05), (0.1, 0.05), (0.1001, 0.04884), (0.1089, 0.04884), (0.109, 0.05), (0.2, 0.05)]
    write_stl(tmp_path / "tube.stl", list(turned(groove)))
    assert design(str(tmp_path / "tube.stl"), "-o", str(tmp_path / "out")) == 0
    line = capsys.readouterr().out.splitlines()[0]
    assert "% of it spans holes and grooves, down to 1." in line


@pytest.mark.long
def test_no_share_is_said_that_prints_as_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Beside holes over 0.02 % of a sheet each."""
    write_stl(tmp_path / "tube.stl", list(turned([(0.0, 0.05), (0.2, 0.05)])))
    found, known = link_design._fit_link, []

    def with_holes(*args: Any, **search: Any) -> tuple[LinkMesh, LinkFit]:
        known.extend([found(*args, **search)] if not known else [])
        source, fit = known[0]
        sheets = (replace(sheet, bridged_share=0.0002 * holes, bridged_depth=0.05) for sheet in fit.sheets)
        return source, replace(fit, sheets=tuple(sheets))

    monkeypatch.setattr(link_design, "_fit_link", with_holes)
    for holes in (1, 3):
        assert design(str(tmp_path / "tube.stl"), "-o", str(tmp_path / f"out{holes}")) == 0
        assert ("spans holes" in capsys.readouterr().out) == (holes == 3)


@pytest.mark.parametrize(
    ("facets", "bridged", "said"),
    [
        (0.0, 0.0, ""),
        (3e-5, 0.0, ", of which the facets of the mesh are up to 0.030 mm"),
        (0.0, 0.012, ", but 1.2% of it spans holes and grooves, down to 1.50 mm"),
    ],
)
def test_a_deviation_is_said_with_what_is_no_mistake_of_the_fit(
    facets: float, bridged: float, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    found = link_design.design_link(Frustum(0.05, 0.05, 0.1, 2.0))
    fitted = FittedSheet(found.sheets[0].place, 1e-4, 5e-5, bridged, 1.5e-3, 1.0, 1.0, facets / 1.5)
    command._print(replace(found, sheets=(replace(found.sheets[0], found=fitted),)))
    line = capsys.readouterr().out.splitlines()[0]
    assert line.partition(", deviation ")[2] == f"0.100 mm at most, 0.050 mm rms{said}"


@pytest.mark.parametrize(
    ("name", "last", "link"),
    [
        ("forearm_link", "next: coneskin init out --simulated --arm UR5e, for your model of arm", False),
        ("handle", "next: coneskin init out --simulated --skin-only, which reports touches", True),
    ],
)
def test_a_mesh_that_is_named_as_a_link_of_an_arm_needs_no_name_any_more(
    name: str, last: str, link: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    command._print_next(SimpleNamespace(name=name, mesh=object(), sheets=[None]), Path("out"))  # type: ignore[arg-type]
    said = capsys.readouterr().out
    assert said.splitlines()[-1] == last
    assert (" --link LINK, with LINK one of base, " in said) is link


@pytest.mark.parametrize(("value", "text"), [(0.00412, "0.0041"), (0.0996, "0.10"), (0.5, "0.50"), (12.3, "12")])
def test_a_small_count_keeps_two_digits(value: float, text: str) -> None:
    assert command._two_digits(value) == text


def test_the_size_of_a_count_is_that_of_the_worst_place() -> None:
    steps = [SimpleNamespace(along=along, around=around) for along, around in ((1e-4, 3e-4), (2.5e-4, 2e-4))]
    assert command._count_size(SimpleNamespace(forecasts=lambda: steps)) == "0.25 mm along, 0.30 mm around"  # type: ignore[arg-type]


def test_a_step_file_that_cannot_be_written_is_refused_before_the_search(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "OCP", None)
    assert design("nowhere.stl", "--set", "drawings.step=true", "-o", str(tmp_path / "out")) == 1
    err = capsys.readouterr().err
    assert "pip install 'coneskin[cad]'" in err
    assert "reading" not in err


@pytest.mark.long
def test_the_next_command_names_the_link_where_the_design_knows_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert design(*CYLINDER, "-o", "skin") == 0
    said = capsys.readouterr().out.splitlines()[-1]
    assert said.startswith("next: coneskin init skin --simulated --arm UR5e --link LINK, with LINK one of base, ")
    assert main(["init", "skin", "--simulated", "--link", "forearm"]) == 0
