"""Reader of scenes: every mistake, all at once, and nothing but SceneError for whatever a file may hold."""

import copy
import math
import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.core.errors import SceneError
from coneskin.scene.build import build_core
from coneskin.scene.reader import load_scene, parse_scene
from coneskin.scene.values.scene import Scene
from coneskin.session.skin_process import virtual_skin
from coneskin.skin.wire import FRAME_LENGTHS

from .scenes import FULL, SERIAL_RETREAT, SKIN_ONLY

VALID = tomllib.loads(FULL)


def mistakes(text: str, folder: Path = Path()) -> list[str]:
    with pytest.raises(SceneError) as caught:
        parse_scene(text, "my.toml", folder)
    assert str(caught.value).startswith("my.toml: ")
    return list(caught.value.problems)


def test_everything_that_a_file_names_arrives_in_si() -> None:
    scene = parse_scene(FULL, "my.toml", Path("/somewhere"))
    assert scene.arm is not None
    assert (scene.arm.model, scene.arm.host, scene.arm.watchdog_hz) == ("UR5e", "127.0.0.1", 4.0)
    assert [link.name for link in scene.links] == ["forearm"]
    assert [item.sensor.frustum.radius1 for item in scene.sensors] == pytest.approx([0.038, 0.046])
    assert scene.sensors[1].placed.link_frustum.translation == (0.0, 0.0, 0.18)
    assert scene.source is not None
    (touch,) = scene.source.touches
    assert (touch.u, touch.phi, touch.sensor) == (0.07, math.pi / 2, "towards the wrist")
    assert scene.reaction is not None
    assert scene.reaction.kind == "stop"
    assert scene.monitoring is not None
    assert scene.monitoring.settle == 0.05
    assert scene.recording is not None
    assert scene.recording.folder == Path("/somewhere/runs")
    assert scene.motion is not None
    assert scene.motion.waypoints[0][1] == -math.pi / 2


def test_what_a_file_leaves_out_is_none() -> None:
    scene = parse_scene(SKIN_ONLY)
    assert (scene.arm, scene.reaction, scene.monitoring, scene.recording, scene.motion) == (None,) * 5
    assert parse_scene("") == Scene("scene", "", Path())


@pytest.mark.parametrize("length", FRAME_LENGTHS)
def test_a_virtual_skin_sends_frames_of_any_length_that_there_is(length: int) -> None:
    scene = parse_scene(with_changes(FULL, ("[source]", f'[source]\nmodel = "ladder"\nframe_length = {length}')))
    _, frame = next(virtual_skin(scene).packets())
    assert len(frame) == length


def with_changes(text: str, *changes: tuple[str, str]) -> str:
    for old, new in changes:
        assert text.count(old) >= 1, old
        text = text.replace(old, new, 1)
    return text


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('model = "UR5e"', 'model = "UR9"', "arm.model: arm must be one of UR3, UR5, UR10"),
        ('model = "UR5e"', "model = 5", "arm.model must be text, got 5"),
        ('model = "UR5e"', "", "arm: the key model is missing"),
        ('host = "127.0.0.1"', 'host = " "', "arm.host must name the controller"),
        ('host = "127.0.0.1"', 'host = "tcp://10.0.0.2/x"', 'write "10.0.0.2": the ports'),
        ('host = "127.0.0.1"', 'host = "[::1]:30002"', 'write "::1": the ports'),
        ('host = "127.0.0.1"', 'host = "me:word@10.0.0.2 30002"', 'write "10.0.0.2": the ports'),
        ('host = "127.0.0.1"', 'host = "ur://"', "write such as 10.0.0.2: the ports"),
        ('host = "127.0.0.1"', 'host = "192.168..10"', "write such as 10.0.0.2: the ports"),
        ('host = "127.0.0.1"', f'host = "{"a" * 64}.org"', "write such as 10.0.0.2: the ports"),
        ('host = "127.0.0.1"', 'host = "a"\nwatchdog_hz = 0', "arm.watchdog_hz must be from 1 to 100 Hz, got 0.0 Hz"),
        ('name = "forearm"', 'name = "tail"', "link tail: an arm has no such link; it has base, shoulder, upper_arm"),
        ('name = "forearm"', 'name = "forearm"\nmesh = "no.stl"', "link forearm.mesh: there is no regular file no.stl"),
        ('name = "forearm"', 'name = "forearm"\nmesh = ""', "link forearm.mesh: there is no regular file"),
        ('name = "forearm"', f'name = "forearm"\nmesh = "{"a" * 5000}"', "link forearm.mesh: there is no regular file"),
        ('name = "forearm"', 'name = "forearm"\nmesh = "a\\u0000b"', "link forearm.mesh: there is no regular file"),
        ('name = "forearm"', 'name = "forearm"\nframe = "tool"', "link forearm.frame must be one of mesh, urdf, dh"),
        ('name = "forearm"', "", "link 1: the key name is missing"),
        ("radius1_mm = 38", "radius1_m = 0.038", "unknown key radius1_m; did you mean radius1_mm?"),
        ("radius1_mm = 38", "radius1_mm = 0.038", "mm, got 0.038 mm: is that in metres? Then write 38"),
        ("radius1_mm = 38", "radius1_mm = nan", "link forearm, sensor 1.radius1_mm must be from 1 to 5000 mm, got nan"),
        ("radius1_mm = 38", "radius1_mm = inf", "link forearm, sensor 1.radius1_mm must be from 1 to 5000 mm, got inf"),
        ("height_mm = 120", "height_mm = 0\nwrap_deg = 400", "sensor 1.wrap_deg must be above 0 to 360 deg, got 400"),
        ("height_mm = 120", "height_mm = 500", "towards the elbow: height_mm must be at most 392.2 mm, the distance"),
        ("id = 2", "id = 1", "sensor 1 of device 0 is already on link forearm; give each sensor its own id"),
        ('"towards the wrist"', '"towards the elbow"', "the name towards the elbow is already on link forearm"),
        ("id = 2", "id = 256", "sensor 256.id must be a whole number from 0 to 255, got 256"),
        ("id = 2", "id = 2\nsupply_v = 3.3", "link forearm, sensor 2: supply_v must be at most 95 %"),
        ("id = 2", "id = 2\nrelease_level = 0.5", "release_level < touch_level"),
        ("id = 2", "id = 2\nrelease_level = 0.03", "release_level must be above 0.03 to 1, got 0.03"),
        ("id = 2", 'id = 2\nradial_positive = "C"', "radial_positive must be one of A, B, got 'C'"),
        ("id = 2", 'id = 2\nfile = "no.toml"', "sensor 2.file: no.toml cannot be read: No such file"),
        ("id = 2", "id = 2\nfile = 7", "sensor 2.file must be text, got 7"),
        ("id = 2", 'id = 2\nfile = "a\\u0000b"', "sensor 2.file"),
        ('kind = "virtual"', 'kind = "usb"', "source.kind must be one of serial, virtual, got 'usb'"),
        (
            'kind = "virtual"',
            'kind = "virtual"\nport = "x"',
            "source.port means nothing to kind virtual: remove it",
        ),
        ('kind = "virtual"', 'kind = "serial"', "source.port is missing: a device such as /dev/ttyUSB0"),
        ("rate_hz = 500", "rate_khz = 5", "source: unknown key rate_khz; did you mean rate_hz?"),
        ("u_mm = 70", "u_mm = 200", "is off towards the wrist, whose u_mm ends at 140.357 and phi_deg at 360: got 200"),
        ("height_mm = 140", "height_mm = 140\nwrap_deg = 80", "phi_deg at 80: got 70 mm and 90 deg"),
        ("sensor = 2", "sensor = 3", "source.touch 1: there is no sensor with the id 3"),
        ("end_s = 2.3", "end_s = 1", "source.touch 1: start_s must be before end_s, got 2 s and 1 s"),
        ('kind = "stop"', 'kind = "flee"', "reaction.kind must be one of slow, comply, retreat, stop, got 'flee'"),
        ('kind = "stop"', 'kind = "stop"\ndistance_mm = 0.06', "is that in metres? Then write 60"),
        ('kind = "stop"', 'kind = "stop"\ndeceleration_deg_s2 = 60', "did you mean deceleration_rad_s2?"),
        ("settle_ms = 50", "settle_ms = 1e9", "monitoring.settle_ms must be from 10 to 10000 ms, got 1000000000.0 ms"),
        ("settle_ms = 50", "settle_s = 0.05", "monitoring: unknown key settle_s; did you mean settle_ms?"),
        ('folder = "runs"', "folder = 1", "recording.folder must be text, got 1"),
        ("-90, 0], [", "-90], [", "motion.waypoints_deg[1] must be a list of 6 numbers"),
        ("[[-40, -90", "[[-40, 400", "motion.waypoints_deg[1][1] must be from -363 to 363 deg, got 400.0 deg"),
        ("80, -90, -90, 0]]", "181, -90, -90, 0]]", "[2]: joint 3 of the UR5e must be from -180 to 180 deg, got 181"),
        ("[60, -80, 80, -90, -90, 0]]", "]", "motion.waypoints_deg needs at least 2 waypoints, got 1"),
        ("speed_deg_s = 40", "speed_deg_s = '40'", "motion.speed_deg_s must be a number [deg/s], got '40'"),
    ],
)
def test_a_mistake_is_one_line_with_key_rule_unit_and_value(old: str, new: str, words: str) -> None:
    problems = mistakes(with_changes(FULL, (old, new)))
    assert any(words in line for line in problems), problems
    assert all("\n" not in line for line in problems)


def test_a_sensor_file_that_is_not_there_is_the_only_mistake() -> None:
    first, rest = FULL.split("[[link.sensor]]", 1)
    (problem,) = mistakes(first + '[[link.sensor]]\nfile = "no.toml"\n' + rest[rest.index("\n[") :])
    assert "sensor 1.file: no.toml cannot be read" in problem


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[arm]]\nmodel = 'UR5e'", "arm must be one table: write [arm], once, got list"),
        ("arm = 5", "arm must be one table"),
        ("[link]\nname = 'a'", "scene.link must be a list of tables, in double brackets, got {'name': 'a'}"),
        ("link = [1]", "scene.link must be a list of tables, in double brackets, got [1]"),
        ("[[link]]\nname = 'a'\n[link.sensor]\nid = 1", "link a.sensor must be a list of tables, in double brackets"),
        ("[source]\nkind = 'virtual'", "[source] needs a [[link]] with a [[link.sensor]]"),
        ("[source]\nkind = 'virtual'\n[[link]]\nname = 'a'", "[source] needs a [[link]] with a [[link.sensor]]"),
        ("[reaction]\nkind = 'stop'", "[reaction] needs an [arm] that can react"),
        ("[motion]\nspeed_deg_s = 1", "[motion] needs an [arm] that can move"),
        ("[motion]\nspeed_deg_s = 1", "motion.waypoints_deg must be a list of lists of 6 joint positions [deg]"),
        ("[robot]\nmodel = 'UR5e'", "unknown table [robot]; known: arm, link, source"),
        ("[recording]", "recording: the key folder is missing"),
        (
            '[recording]\nfolder = "runs"\nkeep = 3',
            "recording.keep counts files, and without recording.max_mb there is only one: set both",
        ),
        ("[reaction]", "reaction: the key kind is missing"),
        ("no toml at all", "not TOML: "),
        ("a = " + "9" * 5000, "not TOML: "),
        ("a = " + "[" * 100_000, "not TOML: "),
    ],
)
def test_a_table_of_another_kind(text: str, words: str) -> None:
    problems = mistakes(text)
    assert any(words in line for line in problems), problems


def test_all_mistakes_are_reported_at_once() -> None:
    text = with_changes(
        FULL,
        ('model = "UR5e"', 'model = "UR9"'),
        ("radius1_mm = 38", "radius1_mm = nan"),
        ("id = 2", "id = 2\nsuply_v = 2"),
        ("rate_hz = 500", "rate_hz = 0"),
        ("end_s = 2.3", "end_s = 1"),
        ('kind = "stop"', 'kind = "flee"'),
        ("settle_ms = 50", "settle_ms = 1"),
        ('folder = "runs"', "folder = 1"),
        ("speed_deg_s = 40", "speed_deg_s = 0"),
    )
    problems = mistakes(text + "\n[sound]\nloud = 1\n")
    names = ("arm.model", "radius1_mm", "suply_v", "rate_hz", "start_s", "kind", "settle_ms", "folder", "speed_deg_s")
    for name in (*names, "[sound]"):
        assert sum(name in line for line in problems) == 1, (name, problems)
    assert len(problems) == 10


def test_one_mistake_makes_no_others() -> None:
    """A sensor that cannot be built is not missing to the touch on it, an arm of another kind not to the reaction."""
    assert len(mistakes(with_changes(FULL, ("radius1_mm = 46", "radius1_mm = nan")))) == 1
    assert len(mistakes(with_changes(FULL, ("sensor = 2", ""), ("radius1_mm = 38", "radius1_mm = nan")))) == 1
    assert len(mistakes(with_changes(FULL, ("[arm]\n", "[[arm]]\n")))) == 1
    assert len(mistakes(with_changes(FULL, ('model = "UR5e"', 'model = "UR9"')))) == 1


@pytest.mark.parametrize("name", ["upper_arm", "upperarm", "upper_arm_link", "Upper-Arm"])
def test_links_are_known_by_every_name_that_the_kinematics_know(name: str) -> None:
    scene = parse_scene(SERIAL_RETREAT.replace('"upper_arm"', f'"{name}"'))
    assert scene.links[0].name == name
    (line,) = mistakes(SERIAL_RETREAT.replace('"upper_arm"', f'"{name}"').replace("height_mm = 400", "height_mm = 700"))
    assert "at most 612.7 mm" in line  # a2 of the UR10e, 0.6127 m: Universal Robots' table


def test_a_sensor_file_is_taken_the_scene_wins_and_a_recording_carries_it(tmp_path: Path) -> None:
    (tmp_path / "sensor.toml").write_text("radius1_mm = 54\nradius2_mm = 54\nheight_mm = 434\nid = 9\n")
    text = '[[link]]\nname = "a"\n[[link.sensor]]\nfile = "sensor.toml"\nid = 3\n'
    scene = parse_scene(text, "my.toml", tmp_path)
    (item,) = scene.sensors
    assert (item.sensor.sensor_id, item.sensor.frustum.height) == (3, 0.434)
    (tmp_path / "sensor.toml").unlink()
    again = parse_scene(scene.text, "my.toml", tmp_path)
    assert (again.links, again.text) == (scene.links, scene.text)


def test_a_recorded_scene_does_without_its_mesh(tmp_path: Path) -> None:
    text = SKIN_ONLY.replace('name = "tube"', 'name = "tube"\nmesh = "gone.stl"')
    assert mistakes(text, tmp_path) == [f"link tube.mesh: there is no regular file {tmp_path / 'gone.stl'}"]
    assert parse_scene(text, "my.toml", tmp_path, recorded=True).sensors


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"\xff\xfe\x00bad", "this is not a TOML text: byte 0 "),
        (b"\x00\x01\x02", "not TOML: "),
        (b"key = ", "not TOML: "),
    ],
)
def test_files_that_are_no_scene(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "my.toml"
    path.write_bytes(content)
    with pytest.raises(SceneError, match=words):
        load_scene(path)
    sensor = f'[[link]]\nname = "a"\n[[link.sensor]]\nfile = "{path.name}"\n'
    with pytest.raises(SceneError, match=r"sensor 1.file: .*my.toml is not TOML"):
        parse_scene(sensor, "s", tmp_path)


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"no.toml: 1 mistake\n  the file cannot be read: No such file"):
        load_scene(tmp_path / "no.toml")
    with pytest.raises(SceneError, match="the file cannot be read: it is a folder"):
        load_scene(str(tmp_path))


def test_a_file_with_a_byte_order_mark(tmp_path: Path) -> None:
    path = tmp_path / "my.toml"
    path.write_bytes(b"\xef\xbb\xbf" + SKIN_ONLY.encode())
    assert load_scene(path).sensors


LEAVES: st.SearchStrategy[Any] = (
    st.none()
    | st.booleans()
    | st.integers(-5, 500)
    | st.just(10**400)
    | st.floats()
    | st.text(max_size=4)
    | st.sampled_from(["", "A", "UR10e", "serial", "dh", "wrist_1", "."])
    | st.dates()
    | st.lists(st.integers(-400, 400), max_size=7)
    | st.just({})
    | st.just([{}])
)


def paths(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Yield the place of every key and of every item of a list."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [deeper for key, item in inside for deeper in ((*path, key), *paths(item, (*path, key)))]


@pytest.mark.long
@settings(max_examples=400)
@given(st.data())
def test_a_valid_scene_with_random_changes_is_a_scene_or_a_list_of_mistakes(data: st.DataObject) -> None:
    tables = copy.deepcopy(VALID)
    for _ in range(data.draw(st.integers(1, 4))):
        where = data.draw(st.sampled_from(paths(tables) or [("x",)]))
        holder: Any = tables
        for key in where[:-1]:
            holder = holder[key]
        value = copy.deepcopy(data.draw(LEAVES))
        change = data.draw(st.sampled_from(["replace", "remove", "add"]))
        if change == "remove" and where[-1] in (holder if isinstance(holder, dict) else range(len(holder))):
            del holder[where[-1]]
        elif change == "add" and isinstance(holder, dict):
            holder[data.draw(st.sampled_from(["x", "file", "mesh", "seed", "supply_v", "touch"]))] = value
        else:
            holder[where[-1]] = value
    text = tomli_w.dumps(without_none(tables))
    problems: tuple[str, ...] = ()
    scene = None
    try:
        scene = parse_scene(text)
    except SceneError as exc:
        problems = exc.problems
    assert all(line and len(line) < 600 for line in problems)
    if scene is None:
        assert problems
        return
    assert parse_scene(scene.text, recorded=True).links == scene.links
    if scene.sensors:  # what the reader lets through can be built
        build_core(scene)
        if scene.source is not None:
            virtual_skin(scene)


def without_none(value: Any) -> Any:
    """TOML has no null: leave such keys and items out."""
    if isinstance(value, dict):
        return {key: without_none(item) for key, item in value.items() if item is not None}
    return [without_none(item) for item in value if item is not None] if isinstance(value, list) else value
