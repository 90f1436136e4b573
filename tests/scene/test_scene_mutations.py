"""Whatever a scene file holds, ``doctor --check`` lists its mistakes: never a traceback, never a long wait."""

import io
from contextlib import redirect_stderr, redirect_stdout
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coneskin.cli import main
from coneskin.core.errors import SceneError
from coneskin.scene.reader import parse_scene
from coneskin.scene.tables.keys import MAX_SIZE

from .scene_mutations import mutate
from .scenes import FULL, SERIAL_RETREAT, SKIN_ONLY


@pytest.mark.long
@settings(max_examples=200)
@given(seed=st.integers(0, 2**32))
def test_no_mutated_scene_gives_a_traceback(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    path = tmp_path_factory.getbasetemp() / "mutated.toml"
    path.write_bytes(mutate((FULL, SKIN_ONLY, SERIAL_RETREAT)[seed % 3], Random(seed)))
    with redirect_stdout(io.StringIO()) as printed, redirect_stderr(io.StringIO()) as said:
        code = main(["doctor", str(path), "--check", *(["--json"] if seed % 2 else [])])
    assert code in (0, 1)
    (printed.getvalue() + said.getvalue()).encode()
    assert "\x1b" not in said.getvalue()
    assert (code == 0) == all(line.startswith("warning: ") for line in said.getvalue().splitlines())


def test_a_scene_has_a_longest_length() -> None:
    with pytest.raises(SceneError, match=f"at most {MAX_SIZE} characters, got {MAX_SIZE + 1}"):
        parse_scene("#" * (MAX_SIZE + 1))


def test_a_key_with_thousands_of_dots_is_refused_before_it_is_read() -> None:
    """A key of 20 kB would keep the TOML reader busy for minutes; remarks and numbers may have any dots."""
    with pytest.raises(SceneError, match="a key must have at most 64 parts"):
        parse_scene("a" + ".a" * 9000 + " = 1")
    with pytest.raises(SceneError, match="a key must have at most 64 parts"):
        parse_scene('[a."b"' + " . 'c'" * 9000 + "]")
    parse_scene("# " + "." * 500 + "\n" + SKIN_ONLY + "# " + "0.1, " * 500)
