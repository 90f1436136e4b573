"""A recording may come from anywhere: nothing that it names is opened, and whatever it holds ends in a clear error."""

import io
import json
import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.cli import main
from coneskin.core.errors import ConeSkinError, SceneError
from coneskin.core.recording.block import Block
from coneskin.core.recording.reader import read_recording
from coneskin.robot.guard.signals.event_text import describe
from coneskin.robot.guard.signals.journal import BlockKind, EventName, GuardEvent
from coneskin.runs.replay.run import read_run
from coneskin.scene.build import decode_surfaces, encode_surfaces, place_on_arm
from coneskin.scene.reader import parse_scene
from tests.geometry.synthetic import frustum
from tests.scene.scenes import FULL, SKIN_ONLY, record
from tests.support.paths import COLLISION
from tests.support.sweep import sweep

from .recording_mutations import mutate, write

_SPY = """
import sys
opened = []
sys.addaudithook(lambda name, args: opened.append(str(args[0])) if name in ("open", "os.listdir") else None)
from coneskin.cli import main
code = main(["replay", sys.argv[1], "--events"])
print([path for path in opened if "canary" in path])
"""


@pytest.fixture(scope="module")
def bases(tmp_path_factory: pytest.TempPathFactory) -> list[list[Block]]:
    """Runs to mutate: an arm that retreats, one that stops, and the collision of the demo."""
    folder = tmp_path_factory.mktemp("bases")
    for name, text in (("0.rec", FULL.replace('kind = "stop"', 'kind = "retreat"')), ("1.rec", FULL)):
        record(folder / name, text)
    demo = COLLISION
    return [list(read_recording(path)) for path in (folder / "0.rec", folder / "1.rec", demo)]


@pytest.mark.long
@settings(max_examples=40)  # of 0.2 s each
@given(seed=st.integers(0, 2**32))
def test_no_mutated_recording_gives_a_traceback(bases: list[list[Block]], tmp_path_factory, seed: int) -> None:
    _replay_mutated(bases, tmp_path_factory.getbasetemp() / "mutated.rec", seed)


@pytest.mark.long
@pytest.mark.parametrize("seed", [1_653_136_768, 654_448])  # a picture that overflows, one without a key
def test_a_mutated_recording_that_gave_a_traceback_is_read(bases: list[list[Block]], tmp_path: Path, seed: int) -> None:
    _replay_mutated(bases, tmp_path / "mutated.rec", seed)


def _replay_mutated(bases: list[list[Block]], path: Path, seed: int) -> None:
    """Checksums are right, so every payload is read; a mistake is a line on stderr and code 1, or 4: parts lack."""
    write(path, mutate(bases[seed % 3], Random(seed)))
    picture = ["--picture", str(path.with_suffix(".png"))] if seed % 16 == 0 else []
    with redirect_stdout(io.StringIO()) as printed, redirect_stderr(io.StringIO()) as said:
        code = main(["replay", str(path), "--json" if seed % 2 else "--events", *picture])
    assert code in (0, 1, 4)
    assert "\x1b" not in printed.getvalue() + said.getvalue()
    printed.getvalue().encode()
    assert not said.getvalue() or said.getvalue().startswith("coneskin replay: ")


@pytest.mark.long
@pytest.mark.promise("P66")
def test_nothing_that_a_header_names_is_opened(tmp_path: Path) -> None:
    record(tmp_path / "run.rec", SKIN_ONLY)
    (tmp_path / "canary.toml").write_text("radius1_mm = 54\nradius2_mm = 54\nheight_mm = 434\n")
    (tmp_path / "canary.stl").write_bytes(b"solid")
    blocks = list(read_recording(tmp_path / "run.rec"))
    header = json.loads(blocks[0].payload)
    for name, old, new in (
        ("file", "[[link.sensor]]", f'[[link.sensor]]\nfile = "{tmp_path}/canary.toml"'),
        ("mesh", 'name = "tube"', f'name = "tube"\nmesh = "{tmp_path}/canary.stl"'),
    ):
        header["scene"] = SKIN_ONLY.replace(old, new, 1)
        path = tmp_path / f"{name}.rec"
        write(path, [blocks[0]._replace(payload=json.dumps(header).encode()), *blocks[1:]])
        done = subprocess.run([sys.executable, "-c", _SPY, str(path)], capture_output=True, text=True, timeout=60)
        assert done.stdout.splitlines()[-1] == "[]", name
        assert "coneskin replay: " in done.stderr


def test_a_recording_carries_the_mesh_that_it_was_made_with(tmp_path: Path) -> None:
    mesh = tmp_path / "tube.obj"
    corners, faces = frustum(0.0535, 0.053, 0.5)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in corners.tolist()] + [
        f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces
    ]
    mesh.write_text("\n".join(lines))
    text = SKIN_ONLY.replace('name = "tube"', 'name = "tube"\nmesh = "tube.obj"')
    live = place_on_arm(parse_scene(text, "s", tmp_path))
    mesh.unlink()
    recorded = parse_scene(text, "s", tmp_path, recorded=True)
    again = place_on_arm(recorded, decode_surfaces(encode_surfaces(live, 0.0)))
    assert again[0].place(0.2, 1.0) == live[0].place(0.2, 1.0)
    assert again[0].place(0.2, 1.0) != place_on_arm(parse_scene(SKIN_ONLY))[0].place(0.2, 1.0)
    with pytest.raises(
        SceneError, match=r"does not carry the mesh below sensor 0/0, .* no file that it names is opened"
    ):
        place_on_arm(recorded, {})


@pytest.mark.promise("P67")
@pytest.mark.skipif(os.name != "posix", reason="permissions of files are POSIX's")
def test_a_recording_is_for_its_owner_alone(tmp_path: Path) -> None:
    record(tmp_path / "run.rec", SKIN_ONLY)
    assert (tmp_path / "run.rec").stat().st_mode & 0o777 == 0o600


def test_an_event_with_other_details_is_written_as_it_is() -> None:
    line = describe(GuardEvent(EventName.CONTACT, 1.5, {"u": "\x1b[2J"}), 1.0)
    assert line == r'   0.5000 s  contact: {"u": "\u001b[2J"}'
    assert "\x1b" not in describe(GuardEvent(EventName.FAULT, 1.5, {"what": "\x1b[2J"}), 1.0)


@pytest.mark.parametrize(
    "details", sweep([{"since": "a", "until": 1.0}, {}, {"since": 1.0, "until": None, "what": ""}])
)
def test_a_gap_without_its_times_is_refused(tmp_path: Path, details: dict[str, object]) -> None:
    record(tmp_path / "run.rec", SKIN_ONLY)
    blocks = list(read_recording(tmp_path / "run.rec"))
    write(tmp_path / "run.rec", [*blocks, GuardEvent(EventName.RECORDING_GAP, blocks[-1].time, details).block()])
    with pytest.raises(ConeSkinError, match=r"recording_gap of .* does not say from and until when"):
        read_run(tmp_path)


def test_a_time_that_is_none_is_refused_with_its_place(tmp_path: Path) -> None:
    record(tmp_path / "run.rec", SKIN_ONLY)
    blocks = list(read_recording(tmp_path / "run.rec"))
    blocks[7] = blocks[7]._replace(time=float("nan"))
    write(tmp_path / "run.rec", blocks)
    with pytest.raises(
        ConeSkinError, match=r"chunk 0 of .* is not what its head says: a block of it has the time nan s"
    ):
        read_run(tmp_path)


@pytest.mark.parametrize(
    "payload",
    [
        b"",
        b"{}\n",
        b"[]\n",
        b'{"sensor": "a", "rows": 1, "columns": 2}\n' + bytes(16),
        b'{"sensor": "a", "rows": 2, "columns": 2}\n' + bytes(31),
        b'{"sensor": "a", "rows": 2, "columns": 2}\n' + b"\xff" * 32,
        b'{"sensor": 5, "rows": 2, "columns": 2}\n' + bytes(32),
    ],
)
def test_a_damaged_surface_is_refused(payload: bytes) -> None:
    with pytest.raises(ConeSkinError, match=r"the block of 1\.500000 s holds no surface of a sensor"):
        decode_surfaces([Block(BlockKind.SURFACE, 1.5, payload)])
