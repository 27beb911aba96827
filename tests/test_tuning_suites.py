"""The suites of benchmarks/tuning.py can be read, and are what they say."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.loading.resolve import read_suite, resolve

SUITES = Path(__file__).resolve().parents[1] / "benchmarks" / "tuning_suites"


@pytest.mark.parametrize("path", sorted(SUITES.glob("*.toml")), ids=lambda path: path.stem)
def test_each_can_be_read(path: Path) -> None:
    assert [entry.name for entry in resolve(str(path))] == [line.name for line in read_suite(path).entry]


def test_labelled_scenes_are_those_of_groups_seen_by_labellers() -> None:
    """Everybody is seen at 2.5 frames/s, and nothing else is changed."""
    groups, labelled = read_suite(SUITES / "groups.toml").entry, read_suite(SUITES / "labelled.toml").entry
    for plain, seen, entry in zip(groups, labelled, resolve(str(SUITES / "labelled.toml")), strict=True):
        sensor = [setting for setting in seen.settings if setting.startswith("sensor.")]
        assert (seen.name, seen.scenario, seen.settings) == (plain.name, plain.scenario, (*plain.settings, *sensor))
        slow = "camera.fps=2.5" in plain.settings
        assert (entry.scenario.sensor.detect_prob == 1, entry.scenario.sensor.clutter_rate == 0) == (slow, slow)
