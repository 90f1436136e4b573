"""Reading meshes: units, axes, welding, and one clear line for each thing that is no link."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import numpy as np
import pytest

from coneskin.core.errors import MeshError, MissingExtra
from coneskin.geometry.mesh import Mesh, _ColladaAsset, _read_collada_asset, load_mesh, make_mesh
from coneskin.geometry.pose import Pose
from coneskin.geometry.urdf import urdf_links

from .synthetic import Floats, Indices, exploded, frustum

TUBE = frustum(0.05, 0.04, 0.3, segments=24, rings=2)


def write_stl(path: Path, body: tuple[Floats, Indices], scale: float = 1.0) -> Path:
    """Binary STL: 80 bytes of header, the count, then 12 floats and 2 bytes for each face."""
    corners = (body[0] * scale)[body[1]].astype("<f4")
    rows = b"".join(struct.pack("<3f", 0, 0, 0) + face.tobytes() + b"\0\0" for face in corners)
    path.write_bytes(b"\0" * 80 + struct.pack("<I", len(corners)) + rows)
    return path


def write_obj(path: Path, body: tuple[Floats, Indices], scale: float = 1.0) -> Path:
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in body[0] * scale]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in body[1]]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_ply(path: Path, body: tuple[Floats, Indices]) -> Path:
    corners, faces = body
    head = ["ply", "format ascii 1.0", f"element vertex {len(corners)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = [f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners] + [f"3 {a} {b} {c}" for a, b, c in faces]
    path.write_text("\n".join(head + rows) + "\n")
    return path


def write_dae(path: Path, body: tuple[Floats, Indices], asset: str, matrix: str = "") -> Path:
    """The smallest COLLADA file with one geometry."""
    corners, faces = body
    numbers = " ".join(f"{x:.9g}" for x in corners.ravel())
    path.write_text(f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2020-01-01T00:00:00</created><modified>2020-01-01T00:00:00</modified>{asset}</asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="{corners.size}">{numbers}</float_array><technique_common>
<accessor source="#pa" count="{len(corners)}" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="{len(faces)}"><input semantic="VERTEX" source="#v" offset="0"/>
<p>{" ".join(str(i) for i in faces.ravel())}</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="n">{matrix}<instance_geometry url="#g"/></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>""")
    return path


def test_formats_agree(tmp_path: Path) -> None:
    meshes = [
        load_mesh(write_stl(tmp_path / "a.stl", TUBE)),
        load_mesh(write_obj(tmp_path / "a.obj", TUBE)),
        load_mesh(write_ply(tmp_path / "a.ply", TUBE)),
        load_mesh(write_dae(tmp_path / "a.dae", TUBE, "<up_axis>Z_UP</up_axis>")),
    ]
    for mesh in meshes:
        assert len(mesh.faces) == len(TUBE[1])
        assert len(mesh.vertices) == len(TUBE[0])
        # files hold float32 or nine digits
        np.testing.assert_allclose(mesh.size, [0.1, 0.1, 0.3], atol=1e-7)


def test_metres_are_guessed_and_said(tmp_path: Path) -> None:
    mesh = load_mesh(write_stl(tmp_path / "a.stl", TUBE))
    assert mesh.unit == "m"
    assert any("unit m guessed from the largest extent, 0.3" in note for note in mesh.notes)


def test_millimetres_are_guessed_and_said(tmp_path: Path) -> None:
    mesh = load_mesh(write_stl(tmp_path / "a.stl", TUBE, 1000.0))
    assert mesh.unit == "mm"
    assert mesh.size[2] == pytest.approx(0.3, abs=1e-7)
    assert any("unit mm guessed" in note for note in mesh.notes)


def test_unit_overrides_the_guess(tmp_path: Path) -> None:
    file = write_stl(tmp_path / "a.stl", TUBE, 1000.0)
    assert load_mesh(file, unit="cm").size[2] == pytest.approx(3.0, abs=1e-6)
    assert load_mesh(write_stl(tmp_path / "b.stl", TUBE, 1 / 0.0254), unit="inch").size[2] == pytest.approx(
        0.3, abs=1e-6
    )


def test_scale_comes_after_the_unit(tmp_path: Path) -> None:
    mesh = load_mesh(write_stl(tmp_path / "a.stl", TUBE, 1000.0), unit="m", scale=(0.001, 0.001, 0.002))
    np.testing.assert_allclose(mesh.size, [0.1, 0.1, 0.6], atol=1e-6)


def test_collada_unit_is_applied(tmp_path: Path) -> None:
    body = (TUBE[0] * 100.0, TUBE[1])
    mesh = load_mesh(
        write_dae(tmp_path / "a.dae", body, '<unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis>')
    )
    assert mesh.size[2] == pytest.approx(0.3, abs=1e-6)
    assert any("centimeter (0.01 m), from the COLLADA file" in note for note in mesh.notes)


def test_only_the_asset_of_the_document_says_the_unit_of_a_collada_file() -> None:
    extra = (
        '<extra><technique profile="tool"><unit name="inch" meter="0.0254"/><up_axis>X_UP</up_axis></technique></extra>'
    )
    own = '<unit name="millimeter" meter="0.001"/><up_axis>Z_UP</up_axis>'
    other = '<asset><unit meter="0.0254"/><up_axis>X_UP</up_axis></asset>'
    part = f"<library_geometries>{other}</library_geometries>"
    for inside in (extra + own, own + extra):  # COLLADA puts the extra last, and some exporters do not
        for text in (f"<asset>{inside}</asset>", f"<asset>{inside}</asset>{part}", f"{part}<asset>{inside}</asset>"):
            data = f'<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema">{text}</COLLADA>'.encode()
            assert _read_collada_asset(Path("a.dae"), data) == _ColladaAsset("millimeter", 0.001, "Z_UP")
    data = f"<COLLADA><asset>{extra}</asset></COLLADA>".encode()
    assert _read_collada_asset(Path("a.dae"), data) == _ColladaAsset("m", 1.0, "Y_UP")  # COLLADA's own defaults


def test_a_collada_tag_of_metres_on_millimetres_is_not_believed(tmp_path: Path) -> None:
    body = (TUBE[0] * 1000.0, TUBE[1])
    tag = '<unit name="meter" meter="1"/><up_axis>Z_UP</up_axis>'
    mesh = load_mesh(write_dae(tmp_path / "a.dae", body, tag))
    assert mesh.size[2] == pytest.approx(0.3, abs=1e-6)
    assert mesh.unit == "mm"
    assert any("declares its unit as meter, which makes a link of 300 m: taken as mm" in note for note in mesh.notes)
    with pytest.raises(MeshError, match="300 m long"):  # a person's word counts
        load_mesh(tmp_path / "a.dae", unit="m")
    scaled = load_mesh(tmp_path / "a.dae", scale=(0.001, 0.001, 0.001))  # as a maker's URDF has it
    assert scaled.size[2] == pytest.approx(0.3, abs=1e-6)
    assert scaled.unit == "meter"


def test_collada_node_matrix_is_applied(tmp_path: Path) -> None:
    matrix = "<matrix>1 0 0 0.5 0 0 -1 0 0 1 0 0 0 0 0 1</matrix>"
    mesh = load_mesh(write_dae(tmp_path / "a.dae", TUBE, "<up_axis>Z_UP</up_axis>", matrix))
    np.testing.assert_allclose(mesh.size, [0.1, 0.3, 0.1], atol=1e-7)
    assert mesh.vertices[:, 0].mean() == pytest.approx(0.5, abs=1e-3)
    assert mesh.vertices[:, 1].min() == pytest.approx(-0.3, abs=1e-7)  # y is -z, not z


def test_each_part_of_a_file_stands_where_its_node_says(tmp_path: Path) -> None:
    path = write_dae(tmp_path / "a.dae", TUBE, "<up_axis>Z_UP</up_axis>")
    again = '<node id="m"><matrix>1 0 0 0.5 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url="#g"/></node>'
    path.write_text(path.read_text().replace("</visual_scene>", f"{again}</visual_scene>"))
    one, both = load_mesh(write_dae(tmp_path / "b.dae", TUBE, "<up_axis>Z_UP</up_axis>")), load_mesh(path)
    assert len(both.faces) == 2 * len(one.faces)
    edges = both.vertices[both.faces] - both.vertices[np.roll(both.faces, 1, axis=1)]
    assert np.linalg.norm(edges, axis=2).max() < 0.4  # none from one part to the other, .5 m away
    np.testing.assert_allclose(both.size, [0.6, 0.1, 0.3], atol=1e-7)


def test_axes_are_kept_whatever_collada_calls_up(tmp_path: Path) -> None:
    mesh = load_mesh(write_dae(tmp_path / "a.dae", TUBE, "<up_axis>Y_UP</up_axis>"))
    np.testing.assert_allclose(mesh.size, [0.1, 0.1, 0.3], atol=1e-7)
    assert any("Y_UP" in note and "kept" in note for note in mesh.notes)


def test_exploded_corners_are_welded() -> None:
    mesh = make_mesh(*exploded(TUBE))
    assert len(mesh.vertices) == len(TUBE[0])
    assert f"welded {3 * len(TUBE[1])} vertices to {len(TUBE[0])}" in mesh.notes
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()  # closed: every edge has two faces


def test_faces_without_area_are_dropped() -> None:
    corners, faces = TUBE
    assert len(make_mesh(corners, np.concatenate([faces, [[0, 0, 1], [2, 3, 3]]])).faces) == len(faces)


def test_arrays_are_read_only_and_the_pose_moves_points() -> None:
    mesh = make_mesh(*TUBE)
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 1.0
    pose = Pose.from_xyz_rpy((1.0, 2.0, 3.0), (0.1, 0.2, 0.3))
    moved = mesh.moved(pose)
    np.testing.assert_allclose(moved.vertices[5], pose.apply(tuple(mesh.vertices[5])), atol=1e-12)


def test_terms_of_two_models_are_told(tmp_path: Path) -> None:
    """Design note, section 7: these meshes are not under the BSD licence of the others."""
    for robot, told in (("ur20", True), ("UR30", True), ("ur10", False)):
        (tmp_path / robot).mkdir()
        notes = load_mesh(write_stl(tmp_path / robot / "arm.stl", TUBE)).notes
        assert any("forbid physical models" in note for note in notes) == told


def test_missing_collada_reader_gives_the_pip_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_reader(*_: object, **__: object) -> Mesh:
        raise ModuleNotFoundError("No module named 'collada'", name="collada")

    monkeypatch.setattr("trimesh.load", no_reader)
    with pytest.raises(
        MissingExtra, match=r"reading a.dae needs the package collada: pip install 'coneskin\[design\]'"
    ):
        load_mesh(write_dae(tmp_path / "a.dae", TUBE, ""))


def test_no_such_file(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match=r"nowhere\.stl: No such file"):
        load_mesh(tmp_path / "nowhere.stl")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("empty.stl", b"", "the file is empty"),
        ("text.stl", b"dear robot, here is no mesh\n", "not a readable STL|no triangles"),
        ("short.stl", b"\0" * 80 + struct.pack("<I", 1000) + b"\0" * 50, "not a readable STL"),
        ("none.stl", b"\0" * 80 + struct.pack("<I", 0), "not a readable STL|no triangles|no faces"),
        ("text.obj", b"# nothing\n", "not a readable OBJ|no triangles"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "not a readable OBJ|no triangles"),
        ("text.ply", b"not a ply", "not a readable PLY"),
        ("broken.dae", b"<COLLADA><asset></COLLADA>", "malformed XML.*line 1"),
        ("late.dae", b"<COLLADA><asset></asset><library", "not a readable DAE|malformed XML"),
        ("other.dae", b"<html></html>", "not a readable DAE"),
        ("mesh.step", b"ISO-10303-21;", r"a mesh is read from .stl, .obj, .dae, .ply, got .step"),
        ("mesh", b"solid", "got no suffix"),
    ],
)
def test_what_is_no_mesh(tmp_path: Path, name: str, content: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MeshError, match=words) as caught:
        load_mesh(tmp_path / name)
    assert "\n" not in str(caught.value)
    assert name in str(caught.value)


@pytest.mark.parametrize(
    ("corners", "words"),
    [
        (np.zeros((3, 3)), "all vertices are one point"),
        (np.outer([0.0, 0.1, 0.2], [1.0, 1.0, 1.0]), "points lie on a line"),
        (np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0.0]]), "flat, 100 mm long"),
        (np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, np.nan]]), "1 of 3 vertices are not finite"),
        (np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, np.inf]]), "1 of 3 vertices are not finite"),
    ],
)
def test_shapes_that_cannot_be_links(corners: Floats, words: str) -> None:
    with pytest.raises(MeshError, match=words):
        make_mesh(corners, np.array([[0, 1, 2]]), "thing")


def test_a_tilted_plane_is_flat() -> None:
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0.0]])
    turned = corners @ np.array(Pose.from_xyz_rpy((0, 0, 0), (0.5, 0.7, 0.1)).rotation).T
    with pytest.raises(MeshError, match="a link must have a volume"):
        make_mesh(turned, np.array([[0, 1, 2], [0, 2, 3]]))


@pytest.mark.parametrize(("scale", "words"), [(1e-4 / 0.3, "only 0.1 mm long"), (100.0 / 0.3, "100 m long")])
def test_sizes_that_cannot_be_links(tmp_path: Path, scale: float, words: str) -> None:
    file = write_stl(tmp_path / "a.stl", TUBE, scale)
    with pytest.raises(MeshError, match=rf"{words} \(unit m\); a link measures 5 mm to 5 m: name the file's unit"):
        load_mesh(file, unit="m")


@pytest.mark.parametrize("corner", [4, -5])
def test_a_file_whose_faces_name_no_corner_is_refused_whether_or_not_its_unit_is_named(
    tmp_path: Path, corner: int
) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    body = "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    file = tmp_path / "a.ply"
    file.write_text(head + body + f"3 0 1 2\n3 0 1 {corner}\n", encoding="ascii")
    for unit in (None, "m"):
        with pytest.raises(MeshError, match=f"a face refers to corner {corner}, there are 4"):
            load_mesh(file, unit=unit)


def test_faces_that_name_no_corner() -> None:
    with pytest.raises(MeshError, match="a face refers to corner 9, there are 3"):
        make_mesh(np.eye(3), np.array([[0, 1, 9]]))
    with pytest.raises(MeshError, match="no faces"):
        make_mesh(np.eye(3), np.zeros((0, 3)))


def test_options_out_of_range(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="unit must be one of m, cm, mm, inch, got 'yard'"):
        load_mesh(tmp_path / "a.stl", unit="yard")


@pytest.mark.long
def test_a_document_as_deep_as_it_is_long_is_read_once(tmp_path: Path) -> None:
    """Each end of an element copied the names of all around it: a minute for a megabyte, the square of it for more."""
    deep = b"<COLLADA>" + b"<a>" * 150_000 + b"<unit meter='3'/>" + b"</a>" * 150_000 + b"</COLLADA>"
    assert _read_collada_asset(tmp_path / "a.dae", deep) == _ColladaAsset()


def test_bad_collada_tags(tmp_path: Path) -> None:
    with pytest.raises(MeshError, match="unit tag must hold metres above 0, got 0"):
        load_mesh(write_dae(tmp_path / "a.dae", TUBE, '<unit meter="0"/>'))
    with pytest.raises(MeshError, match="unit tag must hold a number of metres"):
        load_mesh(write_dae(tmp_path / "b.dae", TUBE, '<unit meter="one"/>'))


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_an_xml_text_that_defines_entities_is_refused(tmp_path: Path, encoding: str) -> None:
    """One entity names a file, another grows by a factor at each level: neither is read, in a mesh or a URDF."""
    for name in ("bomb.dae", "bomb.urdf"):
        text = (
            f'<?xml version="1.0" encoding="{encoding}"?><!DOCTYPE r [<!ENTITY a SYSTEM "canary">]><robot>&a;</robot>'
        )
        (tmp_path / name).write_bytes(text.encode(encoding))
        with pytest.raises(MeshError, match="defines entities is not read"):
            load_mesh(tmp_path / name) if name.endswith("dae") else urdf_links(tmp_path / name)


@pytest.mark.promise("P66")
def test_no_file_that_a_mesh_names_is_opened(tmp_path: Path) -> None:
    """An OBJ may name a file of materials, and that one pictures: a pipe there would never be ready."""
    path = write_obj(tmp_path / "tube.obj", TUBE)
    path.write_text("mtllib pipe.mtl\nusemtl a\n" + path.read_text())
    os.mkfifo(tmp_path / "pipe.mtl")
    assert len(load_mesh(path).faces) == len(TUBE[1])


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("many.stl", b"\0" * 80 + struct.pack("<I", 2**32 - 1) + b"\0" * 50),
        (
            "many.ply",
            b"ply\nformat binary_little_endian 1.0\nelement vertex 99999999999\nproperty float x\nend_header\n",
        ),
        ("many.obj", b"v 0 0 0\n" * 3 + b"f 1 2 99999999999\n"),
        ("long.obj", b"f " + b"1 " * 100_000),
        ("deep.dae", b"<a>" * 100_000),
        ("odd.ply", b"ply\nformat ascii 1.0\nelement vertex -5\nproperty list float x\nend_header\n"),
    ],
)
def test_a_file_that_says_more_than_it_holds_is_refused(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MeshError, match=name.replace(".", r"\.")):
        load_mesh(tmp_path / name)


def test_a_part_of_a_mesh_is_the_chosen_faces_and_the_corners_that_they_use() -> None:
    corners = [(x, y, z) for x in (0.0, 0.1) for y in (0.0, 0.1) for z in (0.0, 0.3)]
    mesh = make_mesh(corners, [(0, 1, 2), (1, 3, 2), (4, 6, 5), (5, 6, 7), (0, 4, 1)])
    chosen = np.array([False, True, False, False, True])
    part = mesh.part(chosen)
    np.testing.assert_array_equal(part.triangles, mesh.triangles[chosen])
    assert len(part.vertices) == 5, "1 is a corner of both faces"
