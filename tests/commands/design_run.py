"""Run of ``coneskin design``, and what it has written."""

from coneskin.cli import main
from coneskin.scene.tables.sensor_tables import build_sensor, merge_sensor_file


def design(*words):
    return main(["design", *words, "--no-pictures"])


def sets(*settings):
    """Return the words that set some options."""
    return [word for setting in settings for word in ("--set", setting)]


def sensor_of(folder):
    problems = []
    table = merge_sensor_file({"file": "sensor.toml"}, "sensor", folder, problems)
    built = build_sensor(table, "sensor", problems)
    assert problems == []
    return built
