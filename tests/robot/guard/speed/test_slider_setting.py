from __future__ import annotations

import pytest

from coneskin.robot.guard.speed.slider_setting import SliderSetting


def test_what_is_read_late_is_not_a_persons_doing() -> None:
    setting = SliderSetting()
    assert not setting.note(0.0, 1.0)
    setting.set(0.0, 0.6, 1.0)
    setting.set(0.06, 0.5, 1.0)
    for now, read in ((0.07, 1.0), (0.08, 0.6), (0.1, 0.6), (0.12, 0.5), (9.0, 0.5)):
        assert not setting.note(now, read)
    assert (setting.ceiling, setting.fraction, setting.shown) == (1.0, 0.5, True)


@pytest.mark.parametrize("read", [0.0, 0.3, 0.55, 0.8, 1.0])
def test_once_the_setting_was_read_anything_else_is_a_persons_doing(read: float) -> None:
    setting = SliderSetting()
    setting.note(0.0, 1.0)
    setting.set(0.0, 0.5, 1.0)
    setting.note(0.02, 0.5)
    assert setting.note(0.04, read)
    assert (setting.ceiling, setting.fraction) == (read, None)


def test_a_slider_that_never_follows_is_a_persons_doing() -> None:
    setting = SliderSetting()
    setting.note(0.0, 1.0)
    setting.set(0.0, 0.5, 1.0)
    assert not setting.note(0.5, 1.0)
    assert setting.note(0.6, 1.0)


def test_a_value_that_was_passed_does_not_come_back_by_itself() -> None:
    setting = SliderSetting()
    setting.note(0.0, 1.0)
    setting.set(0.0, 0.7, 1.0)
    setting.set(0.1, 0.5, 1.0)
    assert not setting.note(0.12, 0.7)
    assert setting.note(0.14, 1.0)
    assert setting.ceiling == 1.0


def test_a_stop_by_the_slider_does_not_become_a_persons_zero() -> None:
    setting = SliderSetting()
    setting.note(0.0, 1.0)
    setting.set(0.0, 0.5, 1.0)
    setting.note(0.1, 0.5)
    setting.resume()  # put back from 0 after a person's reset
    assert not setting.note(30.0, 0.0)
    assert not setting.note(30.02, 0.5)
    assert (setting.ceiling, setting.fraction) == (1.0, 0.5)
    setting.resume()  # after a stop that did not need the slider
    assert not setting.note(60.0, 0.5)
