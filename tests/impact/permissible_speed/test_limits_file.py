from __future__ import annotations

import math
from pathlib import Path

import pytest

from coneskin.core.errors import SceneError
from coneskin.impact.permissible_speed.limits_file import _parse_limits, read_limits

TEXT = """\
[limits]
edition = "invented, edition 1"
transcribed_by = "one"
verified_by = "other"

[[limits.region]]
name = "hand"
links = ["forearm"]
mass_kg = 0.6
tissue_n_per_mm = 75
support_n_per_mm = 20
transient_force_n = 150
lasting_pressure_n_per_cm2 = 60
area_cm2 = 2

[measured]
reaction_ms = 12
deceleration_rad_s2 = 9
by = "a test"
"""


def test_every_key_is_read_in_si() -> None:
    limits = _parse_limits(TEXT)
    (hand,) = limits.regions
    assert (limits.edition, limits.transcribed_by, limits.verified_by) == ("invented, edition 1", "one", "other")
    assert (hand.name, hand.links) == ("hand", frozenset({3}))
    assert (hand.body.mass, hand.body.tissue, hand.body.support) == (0.6, 75e3, 20e3)
    assert hand.limits.transient == 150.0
    assert hand.limits.lasting == pytest.approx(120.0)  # 60 N/cm2 on 2 cm2
    assert (limits.measured.reaction, limits.measured.deceleration, limits.measured.by) == (0.012, 9.0, "a test")


def test_of_force_and_pressure_the_lower_counts() -> None:
    both = TEXT.replace("transient_force_n = 150", "transient_force_n = 150\ntransient_pressure_n_per_cm2 = 50")
    assert _parse_limits(both).regions[0].limits.transient == pytest.approx(100.0)


@pytest.mark.parametrize("line", ["", "support_n_per_mm = 0"])
def test_a_body_without_support_is_free(line: str) -> None:
    assert _parse_limits(TEXT.replace("support_n_per_mm = 20", line)).regions[0].body.support == 0.0


def test_a_clamped_body_needs_no_mass() -> None:
    assert math.isinf(_parse_limits(TEXT.replace("mass_kg = 0.6", "clamped = true")).regions[0].body.mass)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('verified_by = "other"', "", "verified_by is missing"),
        ('verified_by = "other"', 'verified_by = " "', "must not be empty"),
        ('verified_by = "other"', 'verified_by = "One"', "somebody else than transcribed_by"),
        ('edition = "invented, edition 1"', 'edition = ""', "edition must not be empty"),
        ("mass_kg = 0.6", "", "needs mass_kg"),
        ("mass_kg = 0.6", "mass_kg = 0", "must be from 0.001 to 1000 kg"),
        ("mass_kg = 0.6", "mass_kg = nan", "mass_kg must be"),
        ("transient_force_n = 150", "", "needs transient_force_n"),
        ("area_cm2 = 2", "", "needs area_cm2"),
        ('links = ["forearm"]', 'links = ["leg"]', "leg"),
        ('links = ["forearm"]', "links = 3", "must be a list of names"),
        ('by = "a test"', "", "the key by is missing"),
        ('by = "a test"', 'by = ""', "what measured it"),
        ("[measured]", "[mesured]", "unknown table"),
        ("reaction_ms = 12", "reaction_ms = -1", "must be from 0 to 1000 ms"),
        ("[limits]", "[limits", "not TOML"),
    ],
)
def test_a_mistake_is_named(old: str, new: str, message: str) -> None:
    assert old in TEXT
    with pytest.raises(SceneError, match=message):
        _parse_limits(TEXT.replace(old, new, 1))


def test_a_file_that_is_not_there_and_one_that_is_no_text(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"cannot be read: No such file.*docs/do/permissible-speed.md has one"):
        read_limits(tmp_path / "limits.toml")
    (tmp_path / "limits.toml").write_bytes(b"\xff")
    with pytest.raises(SceneError, match="UTF-8"):
        read_limits(tmp_path / "limits.toml")
