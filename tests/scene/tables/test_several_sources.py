"""Several [[source]] in a scene: each is read by its row, all are opened as one."""

from importlib.metadata import EntryPoint, EntryPoints

import pytest

from coneskin.core.errors import SceneError, SensorError
from coneskin.core.keys import Key
from coneskin.scene.reader import parse_scene
from coneskin.scene.summary import summarize
from coneskin.skin.sources.kinds import GROUP, SourceKind, open_source
from coneskin.skin.sources.source import SourceGroup

LINKS = """
[[link]]
name = "forearm"
[[link.sensor]]
radius1_mm = 54
radius2_mm = 54
height_mm = 400
[[link.sensor]]
id = 1
radius1_mm = 40
radius2_mm = 40
height_mm = 400
"""
TWO = """
[[source]]
kind = "serial"
port = "/dev/ttyUSB0"
[[source]]
kind = "serial"
port = "/dev/ttyUSB1"
baud = 1200
"""
#: a row that a package of somebody else's might bring
BUS = SourceKind("coneskin.skin.sources.serial_port:SerialPort", (Key("port", str, meaning="a bus"),))
NO_ROW = 7


def test_two_ports_are_read_as_one() -> None:
    scene = parse_scene(LINKS + TWO)
    assert scene.source is not None
    assert scene.source.kind == GROUP
    assert scene.source.settings["members"] == (
        ("serial", {"port": "/dev/ttyUSB0", "baud": 921600}),
        ("serial", {"port": "/dev/ttyUSB1", "baud": 1200}),
    )
    assert summarize(scene)["source"] == "serial /dev/ttyUSB0 + serial /dev/ttyUSB1"
    source = open_source(scene.source.kind, scene.source.settings)
    assert isinstance(source, SourceGroup)
    assert source.name == "/dev/ttyUSB0 + /dev/ttyUSB1"


def test_a_list_of_one_is_that_one() -> None:
    scene = parse_scene(LINKS + TWO[: TWO.rindex("[[source]]")])
    assert scene.source is not None
    assert (scene.source.kind, scene.source.settings["port"]) == ("serial", "/dev/ttyUSB0")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("baud = 1200", "baud = 1199", "source 2.baud"),
        ('port = "/dev/ttyUSB1"\n', "", "source 2.port is missing: a device such as"),
        ("USB1", "USB0", None),
        ('USB1"\nbaud = 1200', 'USB0"', "source 2 is the same as another one: no port can be read twice"),
        (
            'kind = "serial"\nport = "/dev/ttyUSB1"\nbaud = 1200',
            'kind = "virtual"',
            "source 2: a virtual skin",
        ),
    ],
)
def test_mistakes_name_the_source(old: str, new: str, message: str | None) -> None:
    text = LINKS + TWO.replace(old, new)
    if message is None:  # another baud rate does not make it another port: the group refuses it
        with pytest.raises(SensorError, match="different ports"):
            open_source(GROUP, parse_scene(text).source.settings)  # type: ignore[union-attr]
        return
    with pytest.raises(SceneError) as error:
        parse_scene(text)
    assert message in str(error.value)


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two entry points, as an installed package has them."""
    points = [
        EntryPoint("field-bus", f"{__name__}:BUS", "coneskin.sources"),
        EntryPoint("broken", f"{__name__}:NO_ROW", "coneskin.sources"),
    ]

    def entry_points(*, group: str, name: str) -> EntryPoints:
        return EntryPoints(point for point in points if (point.group, point.name) == (group, name))

    monkeypatch.setattr("importlib.metadata.entry_points", entry_points)


def test_a_source_of_an_installed_package_is_named_like_ours(installed: None) -> None:
    scene = parse_scene(LINKS + '[source]\nkind = "field-bus"\nport = "bus0"\n')
    assert scene.source is not None
    assert scene.source.settings == {"port": "bus0"}
    assert open_source("field-bus", scene.source.settings).name == "bus0"
    with pytest.raises(SceneError, match=r"source\.port is missing: a bus"):
        parse_scene(LINKS + '[source]\nkind = "field-bus"\n')


def test_what_is_no_row_is_refused(installed: None) -> None:
    with pytest.raises(SceneError, match="the source 'broken' must be a SourceKind"):
        parse_scene(LINKS + '[source]\nkind = "broken"\n')
