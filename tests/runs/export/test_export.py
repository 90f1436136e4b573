"""What is exported is read back by each format's own reader, equal to what is in the recording."""

import csv
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from coneskin.core.errors import RecordingError
from coneskin.robot.arm.models import arm_model
from coneskin.robot.guard.signals.journal import BlockKind
from coneskin.runs.export.export import export_run
from coneskin.runs.export.mcap_file import _drawn_arm
from coneskin.runs.export.tables import Table, table_pieces
from coneskin.runs.replay.run import Run
from coneskin.skin.wire import DrivenPotentials, FrameDecoder, encode


def run_tables(run: Run) -> dict[str, Table]:
    """The tables of a run, whole; one without rows is left out."""
    tables: dict[str, dict[str, list[object]]] = {}
    for name, pieces in table_pieces(run).items():
        for piece in pieces():
            for column, values in piece.items():
                tables.setdefault(name, {}).setdefault(column, []).extend(values)
    return tables


@pytest.fixture(scope="module")
def tables(collision: Run) -> dict[str, Table]:
    return run_tables(collision)


def test_the_tables_hold_what_was_recorded_with_units_in_the_names(collision: Run, tables: dict[str, Table]) -> None:
    assert list(tables) == ["events", "frames", "arm", "slider", "commands"]
    events = tables["events"]
    contact = next(event for event in collision.events if event.name == "contact")
    row = events["event"].index("contact")
    start = collision.header["clocks"]["monotonic"]
    assert events["time_s"][row] == contact.time - start
    assert (events["u_m"][row], events["phi_rad"][row]) == (contact.details["u"], contact.details["phi"])
    assert [events[f"point_{axis}_m"][row] for axis in "xyz"] == contact.details["point"]
    assert json.loads(events["details_json"][row]) == contact.details
    frames = list(collision.frames())
    assert tables["frames"]["clock_us"] == [frame.clock_us for _, frame in frames]
    assert tables["frames"]["touch_c_counts"] == [frame.touch_c for _, frame in frames]
    states = list(collision.states())
    assert len(states) == 992
    assert tables["arm"]["qd1_rad_s"] == [state.qd[0] for state in states]
    assert len(tables["commands"]["command"]) == 148
    assert tables["slider"]["fraction"][0] == 1.0


def test_long_frames_have_columns_for_what_short_ones_have_not(collision: Run) -> None:
    block = next(block for block in collision.blocks if block.kind == BlockKind.SKIN)
    first = FrameDecoder().feed(block.payload)[0]
    driven = DrivenPotentials(1, 2, 3, 4, 5, 6)
    data = encode(first) + encode(first._replace(length=52, driven=driven))
    run = replace(collision, blocks=(block._replace(payload=data),))
    frames = run_tables(run)["frames"]
    assert frames["length"] == [36, 52]
    assert frames["driven_angular_d_counts"] == [None, 6]
    assert {len(column) for column in frames.values()} == {2}


def test_csv_is_read_back_equal(collision: Run, tables: dict[str, Table], tmp_path: Path) -> None:
    written = export_run(collision, tmp_path / "out", "csv")
    assert {path.stem: rows for path, rows in written.items()} == {
        name: len(table["time_s"]) for name, table in tables.items()
    }
    for name, table in tables.items():
        with (tmp_path / "out" / f"{name}.csv").open(encoding="utf-8", newline="") as file:
            head, *rows = csv.reader(file)
        assert head == list(table)
        for column, texts in zip(head, zip(*rows, strict=True), strict=True):
            values = [None if text == "" else _typed(text, table[column]) for text in texts]
            assert _equal(values, table[column]), (name, column)


def _typed(text: str, column: list) -> object:
    kind = type(next(value for value in column if value is not None))
    return text == "True" if kind is bool else kind(text)


def _equal(one: list, other: list) -> bool:
    return all(a == b or (a != a and b != b) for a, b in zip(one, other, strict=True))


@pytest.mark.long
def test_parquet_is_read_back_equal_by_duckdb_and_by_pyarrow(
    collision: Run, tables: dict[str, Table], tmp_path: Path
) -> None:
    duckdb = pytest.importorskip("duckdb")
    parquet = pytest.importorskip("pyarrow.parquet")
    export_run(collision, tmp_path, "parquet")
    for name, table in tables.items():
        read = parquet.read_table(tmp_path / f"{name}.parquet").to_pydict()
        assert list(read) == list(table)
        assert all(_equal(read[column], list(table[column])) for column in table)
    with duckdb.connect() as base:
        query = f"select event, u_m from '{tmp_path}/events.parquet' where u_m is not null order by time_s"
        rows = base.execute(query).fetchall()
    assert [row[0] for row in rows] == ["contact", "contact_located"]
    assert rows[0][1] == next(event for event in collision.events if event.name == "contact").details["u"]


def test_npz_is_read_back_equal(collision: Run, tables: dict[str, Table], tmp_path: Path) -> None:
    path = tmp_path / "run.npz"
    export_run(collision, path, "npz")
    with np.load(path, allow_pickle=False) as arrays:
        assert set(arrays.files) == {f"{name}.{column}" for name, table in tables.items() for column in table}
        for name, table in tables.items():
            for column, values in table.items():
                got = arrays[f"{name}.{column}"].tolist()
                kept = [pair for pair in zip(got, values, strict=True) if pair[1] is not None]
                assert _equal([a for a, _ in kept], [b for _, b in kept]), column
                absent = [a for a, b in zip(got, values, strict=True) if b is None]
                assert all(a == "" or math.isnan(a) for a in absent)


@pytest.mark.long
def test_mcap_is_read_back_equal_and_fits_its_schemas(collision: Run, tables: dict[str, Table], tmp_path: Path) -> None:
    reader = pytest.importorskip("mcap.reader")
    jsonschema = pytest.importorskip("jsonschema")
    path = tmp_path / "run.mcap"
    (count,) = export_run(collision, path, "mcap").values()
    clocks = collision.header["clocks"]
    topics: dict[str, list[tuple[float, dict]]] = {}
    validators = {}
    with path.open("rb") as file:
        for schema, channel, message in reader.make_reader(file, validate_crcs=True).iter_messages():
            value = json.loads(message.data)
            if schema.name not in validators:
                assert schema.encoding == "jsonschema"
                validators[schema.name] = jsonschema.Draft202012Validator(json.loads(schema.data))
                validators[schema.name].validate(value)
            topics.setdefault(channel.topic, []).append((message.log_time / 1e9 - clocks["unix"], value))
    assert sum(map(len, topics.values())) == count
    own = {f"coneskin.{name}" for name in ("ArmState", "Command", "SpeedSlider", "TouchLevel")}
    assert set(validators) == {"foxglove.Log", "foxglove.SceneUpdate", *own}
    assert [value["name"] for _, value in topics["/events"]] == tables["events"]["event"]
    assert [value["qd1_rad_s"] for _, value in topics["/arm"]] == tables["arm"]["qd1_rad_s"]
    assert [time for time, _ in topics["/arm"]] == pytest.approx(tables["arm"]["time_s"], abs=1e-6)
    assert len(topics["/skin/0_1"]) == len(tables["frames"]["time_s"])
    assert [value["fraction"] for _, value in topics["/slider"]] == tables["slider"]["fraction"]
    assert [value["command"] for _, value in topics["/commands"]] == tables["commands"]["command"]
    sent = [json.loads(numbers) for numbers in tables["commands"]["numbers_json"]]
    assert [value["numbers"] for _, value in topics["/commands"]] == sent
    (entity,) = topics["/drawing/contacts"][0][1]["entities"]
    validators["foxglove.SceneUpdate"].validate(topics["/drawing/contacts"][0][1])
    place = entity["spheres"][0]["pose"]["position"]
    assert math.dist((0, 0, 0.16), (place["x"], place["y"], place["z"])) < 1.3  # within the reach of the arm
    assert len(topics["/drawing/arm"]) > 50


def test_the_arm_is_drawn_fifty_times_a_second_at_most(collision: Run) -> None:
    """It is recorded 500 times a second, and a file with each drawing would be ten times as large."""
    times = [state.time for state in collision.states()]
    drawn = [message.time for message in _drawn_arm(collision, arm_model("UR5e"), (), 0.0)]
    assert drawn[0] == times[0]
    apart = np.diff(drawn)
    assert apart.min() >= 0.02
    assert apart.max() <= 0.02 + np.diff(times).max(), "with the next state that is due"


@pytest.mark.parametrize("form", ["csv", "parquet", "npz", "mcap"])
def test_nothing_is_overwritten(collision: Run, tmp_path: Path, form: str) -> None:
    target = tmp_path / "out"
    target.write_text("mine", encoding="utf-8")
    with pytest.raises(RecordingError, match="is there already; nothing is overwritten"):
        export_run(collision, target, form)
    assert target.read_text(encoding="utf-8") == "mine"


def test_another_form_is_refused(collision: Run, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="exported as csv, parquet, npz, mcap, got 'xls'"):
        export_run(collision, tmp_path / "out", "xls")


@pytest.mark.parametrize(("name", "form"), [("run.mcap", "csv"), ("run.npz", "mcap")])
def test_a_target_named_after_another_form_is_refused(collision: Run, tmp_path: Path, name: str, form: str) -> None:
    with pytest.raises(RecordingError, match=rf"{name} is named as {name[4:]}, but the format is {form}: name another"):
        export_run(collision, tmp_path / name, form)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["out", "run.npz", "run.mcap"])
def test_a_run_without_anything_is_no_export(collision: Run, tmp_path: Path, name: str) -> None:
    if name == "run.mcap":
        pytest.importorskip("mcap", reason="the extra coneskin[mcap] is not installed")
    with pytest.raises(RecordingError, match="nothing is exported"):
        export_run(replace(collision, blocks=()), tmp_path / "new" / name)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize("form", ["csv", "parquet", "npz", "mcap"])
def test_an_export_that_fails_leaves_nothing_torn(
    collision: Run, tmp_path: Path, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for package in {"parquet": ("pyarrow",), "mcap": ("mcap",)}.get(form, ()):
        pytest.importorskip(package, reason=f"the package {package} is not installed")

    def torn(run: Run, *_: object) -> Iterator[object]:
        yield next(states)
        raise OSError(28, "No space left on device")

    states = collision.states()
    monkeypatch.setattr(Run, "states", torn)
    with pytest.raises(RecordingError, match=r"cannot write .*No space left"):
        export_run(collision, tmp_path / "out", form)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.long
def test_a_table_in_pieces_is_the_table(
    collision: Run, tables: dict[str, Table], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    export_run(collision, tmp_path / "large.npz", "npz")
    export_run(collision, tmp_path / "large", "csv")
    monkeypatch.setattr("coneskin.runs.export.tables._PIECE_ROWS", 100)
    assert len(list(table_pieces(collision)["frames"]())) == math.ceil(len(tables["frames"]["time_s"]) / 100)
    assert run_tables(collision) == tables
    written = export_run(collision, tmp_path / "small.npz", "npz")
    assert list(written.values()) == [sum(len(next(iter(table.values()))) for table in tables.values())]
    with np.load(tmp_path / "small.npz") as small, np.load(tmp_path / "large.npz") as large:
        assert small.files == large.files
        assert all(_equal(small[name].tolist(), large[name].tolist()) for name in small.files)
    for path in export_run(collision, tmp_path / "small", "csv"):
        assert path.read_bytes() == (tmp_path / "large" / path.name).read_bytes()
