from pathlib import Path

import pytest

import scenarios
from scenarios.errors import InputError
from scenarios.loading.resolve import dump_sensor, sensor_settings
from scenarios.schema.sensor import BoxNoise, FalseAlarms, Hide, Memory, Sensor

MINE = Sensor(
    detect_prob=0.9,
    by_visibility=(0.0, 0.5, 1.0),
    miss_memory=(Memory(share=0.4, time=0.5), Memory(share=0.2, time=5.0)),
    box_noise=BoxNoise(across=(-0.01, 0.05), memory=(Memory(share=0.3, time=1.0),)),
    points="foot",
    false_alarms=FalseAlarms(life=1.5, at=((0.2, 0.3), (0.5, 0.9))),
    true_scores=(0.1, 0.9),
)


def test_what_is_written_is_what_a_scenario_gets(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(dump_sensor(MINE, "one line\nanother"))
    assert path.read_text().startswith("# one line\n# another\nschema = 1\n")
    assert scenarios.load("street", set=scenarios.sensor_settings(path)).sensor == MINE


def test_settings_after_it_win_and_hiding_stays(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(dump_sensor(MINE))
    hide = "sensor.hide=[{ start = 1.0, end = 2.0 }]"
    found = scenarios.load("merge", set=[hide, *sensor_settings(path), "sensor.detect_prob=0.5"]).sensor
    assert found.hide == (Hide(start=1.0, end=2.0),)
    assert found == MINE.model_copy(update={"detect_prob": 0.5, "hide": found.hide})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "'sensor'"), ("[sensor]\ndetect_prop = 0.5", "detect_prob"),
        ("[sensor]\ndetect_prob = 1.5", "sensor.detect_prob"), ("[camera]\nfps = 5\n[sensor]\n", "'camera'"),
        ("[sensor]\nnoise_px = 3", "set box_noise.scale"), ("[sensor]\nbox_noise = { acros = [0, 1] }", "'across'"),
        ("[sensor]\nmiss_memory = [{ share = 0.5, time = 1.0 }]\npersistence = 0.5", "miss_memory or persistence"),
        ("[sensor]\nmiss_memory = [{ share = 0.6, time = 1.0 }, { share = 0.6, time = 2.0 }]", "at most 1"),
        ("[sensor]\ntrue_scores = [0.5, 0.4]", "do not decrease"), ("schema = 2\n[sensor]\n", "schema"),
        ("[sensor", "TOML"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_one_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        sensor_settings(path)
    assert words in str(error.value)
    assert "bad.toml" in str(error.value)
