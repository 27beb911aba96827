"""Values that change during a scene: how they are written, drawn, described and refused."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import pytest

from scenarios.drawing.words import text
from scenarios.errors import InputError
from scenarios.loading.resolve import load
from scenarios.loading.toml_files import dump
from scenarios.schema.schedule import Schedule
from sim.draws import drawn

FALLS = "sensor.detect_prob={at=[0, 20, 40], value=[0.95, 0.6, 0.9], ramp=5}"
GIVEN = [
    FALLS, "sensor.clutter_rate={at=[0, 5], value=[0.1, 3]}", "sensor.every={at=[0, 5], value=[1, 5]}",
    "sensor.noise_m={at=[0, 5], value=[0.1, 0.3]}", "sensor.box_noise.scale={at=[0, 5], value=[1, 0]}",
    "camera.motion={kind='shake', px={at=[0, 5], value=[1, 10]}}",
]  # fmt: skip


@pytest.mark.parametrize("setting", GIVEN)
def test_a_scenario_with_a_schedule_is_written_and_copied_as_it_was_read(setting: str, tmp_path: Path) -> None:
    scenario = load("cross", [setting])
    assert scenario != load("cross")
    assert pickle.loads(pickle.dumps(scenario)) == copy.deepcopy(scenario) == scenario
    file = tmp_path / "cross.toml"
    file.write_text(dump(scenario))
    assert load(file) == scenario
    assert "at = [0.0, " in file.read_text()


def test_schedules_are_said_in_words() -> None:
    said = text(load("cross", GIVEN))
    assert "detects 95% (from 20 s 60%, from 40 s 90%, each within 5 s) of fully visible people" in said
    assert "0.1 (from 5 s 3) false alarms per frame" in said
    assert "noise_m = { at = [0.0, 5.0], value = [0.1, 0.3] }" in said


def test_scenarios_without_schedules_are_written_as_before() -> None:
    """Their hashes name stored sequences."""
    assert "every" not in dump(load("cross"))


def test_settings_replace_a_schedule_and_values_in_it() -> None:
    scenario = load("cross", [FALLS, "sensor.detect_prob.value.1=0.3", "sensor.detect_prob.ramp=2"])
    assert scenario.sensor.detect_prob.value == (0.95, 0.3, 0.9)  # type: ignore[union-attr]
    assert scenario.sensor.detect_prob.ramp == 2  # type: ignore[union-attr]
    assert load("cross", [FALLS, "sensor.detect_prob=0.5"]).sensor.detect_prob == 0.5


@pytest.mark.parametrize(
    "below", ["{ at = [0, 20, 40], value = [0.9, 0.6, 0.8], ramp = 5 }", "{ uniform = [0.2, 0.4] }"]
)
def test_a_schedule_replaces_what_the_base_has_as_a_whole(below: str, tmp_path: Path) -> None:
    base, above = tmp_path / "base.toml", tmp_path / "above.toml"
    base.write_text(
        f'extends = "cross"\n[sensor]\ndetect_prob = {below}\nfalse_alarms = {{ life = 3, at = [[0.5, 0.5]] }}\n'
    )
    text = "[sensor]\ndetect_prob = { at = [0, 5], value = [1, 0.5] }\nfalse_alarms = { at = [[0.1, 0.2]] }\n"
    above.write_text(f'extends = "base.toml"\n{text}')
    found = load(above)
    assert found.sensor.detect_prob == Schedule(at=(0, 5), value=(1, 0.5))
    assert found.sensor.false_alarms is not None
    assert found.sensor.false_alarms.life == 3
    assert found.draws is None


PROB = "sensor.detect_prob"
WRONG = {
    PROB + "={at=[0, 20], value=[0.95]}": "got 2 times and 1 values; expected as many values as times",
    PROB + "={at=[1, 20], value=[0.95, 0.5]}": "got [1.0, 20.0]; expected times that ascend from 0",
    PROB + "={at=[0, 20, 20], value=[1, 0.5, 0.3]}": "expected times that ascend from 0",
    PROB + "={at=[0, -5], value=[1, 0.5]}": "got -5; expected greater than or equal to 0",
    PROB + "={at=[0, 20], value=[0.95, 1.5]}": "got 1.5; expected from 0 to 1",
    PROB + "=1.5": "got 1.5; expected from 0 to 1",
    PROB + "={at=[0, 20], values=[0.95, 0.5]}": "got unknown key 'values'; expected a known key; did you mean value?",
    PROB + "={ats=[0, 20], value=[0.95, 0.5]}": "got unknown key 'ats'; expected a known key; did you mean at?",
    PROB + "={at=[0], value=[0.95]}": "got [0]; expected a length of at least 2",
    PROB + "={at=[0, 5, 8], value=[1, 0.3, 0.4], ramp=4}": "ramp = 4; expected no longer than the time between two",
    PROB + "={at=[0, 5], value=[1, 0.5], ramp=-1}": "got -1; expected greater than or equal to 0",
    PROB + "={at=[0, 5], value=[1, 'x']}": "got 'x'; expected a number",
    PROB + "={value=[1, 0.2]}": "expected the key 'at'; add it",
    PROB + "={}": "got { }; expected a number",
    PROB + "={at=[0, nan], value=[1, 0.5]}": "got nan; expected a finite number",
    "sensor.occlusion_power={at=[0, 5], value=[1, 0.5]}": "expected a number",
    "sensor.clutter_rate={at=[0, 5], value=[1, -1]}": "got -1 false alarms per frame; expected from 0 to 1000",
    "sensor.every={at=[0, 5], value=[0.5, 1]}": "got 0.5 frames; expected from 1 to 1000 frames",
    "sensor.every=0": "got 0 frames; expected from 1 to 1000 frames",
    "sensor.noise_m={at=[0, 5], value=[0, 1e4]}": "got 10000 m; expected from 0 to 1000 m",
    "sensor.box_noise.scale={at=[0, 5], value=[1, 99]}": "got 99; expected from 0 to 20",
    "camera.motion={kind='shake', px={at=[0, 5], value=[1, 1000]}}": "got 1000 px; expected from 0 to 500 px",
}


@pytest.mark.parametrize(("setting", "words"), WRONG.items())
def test_a_wrong_schedule_is_one_line(setting: str, words: str) -> None:
    with pytest.raises(InputError) as error:
        load("cross", [setting])
    line = error.value.line()
    assert words in line
    assert f"--set {setting}" in line
    assert "\n" not in line
    assert "more problem" not in line


def test_times_and_values_may_be_drawn_and_linked() -> None:
    kinds = ["draw.bad={choice=[0, 1]}", "camera.motion={kind='shake', px={at=[0, 3], value=[0, {uniform=[1, 9]}]}}"]
    falls = "sensor.detect_prob={at=[0, {uniform=[5, 9]}], value=[0.9, {link='bad', values=[0.8, 0.2]}]}"
    scenario = load("cross", [*kinds, falls, "sensor.noise_m={choice=[0.1, {at=[0, 1], value=[0.1, 0.5]}]}"])
    found = [drawn(scenario, seed) for seed in range(30_000, 30_040)]
    schedules = [s.sensor.detect_prob for s in found]
    assert {s.value for s in schedules} == {(0.9, 0.8), (0.9, 0.2)}  # type: ignore[union-attr]
    late = [s.at[1] for s in schedules]  # type: ignore[union-attr]
    assert 5 <= min(late) < 5.6 < 8.4 < max(late) <= 9
    assert len({s.camera.motion.px.value[1] for s in found}) == 40  # type: ignore[union-attr]
    assert {isinstance(s.sensor.noise_m, float) for s in found} == {True, False}
    with pytest.raises(InputError, match=r"sensor\.detect_prob: got 1\.4; expected from 0 to 1"):
        load("cross", ["sensor.detect_prob={at=[0, 9], value=[1, {uniform=[0.3, 1.4]}]}"])
