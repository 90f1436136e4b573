"""The tree of errors: each leaf is a builtin too, and crosses a process boundary whole."""

import builtins
import pickle

import pytest

from coneskin.core import errors
from coneskin.core.errors import Collision, ConeSkinError, MissingExtra, SceneError
from coneskin.robot.guard.signals.journal import EventName, GuardEvent

TOUCH = GuardEvent(
    EventName.CONTACT_LOCATED,
    4.5,
    {
        "sensor": "cuff", "link": "forearm", "u": 0.12, "phi": 1.5, "point": [0.1, 0.2, 0.3], "normal": [0.0, 0.0, 1.0],
        "level": 0.7, "location_valid": True,
    },
)  # fmt: skip
MADE = [
    Collision("touched", TOUCH, True, "touch; retreat 49.5 mm: the distance is made"),
    MissingExtra("matplotlib", "a picture", "pictures"),
    SceneError(["one", "two"], "scene.toml"),
]


@pytest.mark.parametrize("error", MADE, ids=lambda error: type(error).__name__)
def test_an_error_is_the_same_in_another_process(error: ConeSkinError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)


def test_a_collision_carries_the_touch_as_values() -> None:
    collision = MADE[0]
    assert isinstance(collision, Collision)
    assert (collision.sensor, collision.link, collision.u, collision.phi) == ("cuff", "forearm", 0.12, 1.5)
    assert (collision.point, collision.normal) == ((0.1, 0.2, 0.3), (0.0, 0.0, 1.0))
    assert (collision.level, collision.time, collision.location_valid) == (0.7, 4.5, True)
    assert collision.standstill_confirmed
    assert Collision("touched").standstill_confirmed is False
    assert collision.event is TOUCH


ERRORS = {name: kind for name, kind in vars(errors).items() if isinstance(kind, type)}


@pytest.mark.parametrize("name", [name for name, kind in ERRORS.items() if issubclass(kind, ConeSkinError)])
def test_the_tree_is_drawn_as_it_is(name: str) -> None:
    """The drawing in the module's docstring names each error, and the builtin that it is as well."""
    kind = getattr(errors, name)
    (line,) = [line for line in (errors.__doc__ or "").splitlines() if line.lstrip("│├└─ ").split(" ")[0] == name]
    drawn = line.split("(")[1].split(")")[0] if "(" in line else ""
    if drawn:
        assert issubclass(kind, getattr(builtins, drawn))
