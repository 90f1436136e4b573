"""Patches of a scene's text: the right sensor, comments kept, an older value replaced."""

import pytest

from coneskin.commissioning.examination.examination import diff_texts, set_sensor_keys
from coneskin.core.errors import SceneError

TEXT = """\
# mine
[[link]]
name = "tube"
[[link.sensor]]   # the first
id = 1
radial_positive = "B"  # as built
[[ link.sensor ]]
id = 2
[source]
kind = "virtual"
"""


def test_the_keys_of_one_sensor_are_set_and_all_else_stays() -> None:
    patched = set_sensor_keys(TEXT, 0, {"radial_positive": "A"})
    assert patched == TEXT.replace('id = 1\nradial_positive = "B"  # as built', 'radial_positive = "A"\nid = 1')
    second = set_sensor_keys(TEXT, 1, {"angular_positive": "D"})
    assert second == TEXT.replace("id = 2", 'angular_positive = "D"\nid = 2')
    assert diff_texts(TEXT, second, "s.toml").splitlines()[-5:] == [
        ' radial_positive = "B"  # as built',
        " [[ link.sensor ]]",
        '+angular_positive = "D"',
        " id = 2",
        " [source]",
    ]


def test_a_sensor_at_the_very_end_and_one_that_is_not_there() -> None:
    assert set_sensor_keys("[[link.sensor]]", 0, {"radial_positive": "A"}) == '[[link.sensor]]\nradial_positive = "A"\n'
    with pytest.raises(SceneError, match='write radial_positive = "A" yourself'):
        set_sensor_keys("link = [{sensor = [{}]}]", 0, {"radial_positive": "A"})
