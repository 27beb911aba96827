"""What click accepts in silence is an error: an option given twice, a key given twice, numbers in other digits."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import typer

from tests.short_scene import write_short_scene
from tracking.app.cli import app, run

ARABIC = str.maketrans("0123456789", "٠١٢٣٤٥٦٧٨٩")


def commands(group: Any, above: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], Any]]:
    """All commands with the words that call them."""
    found = []
    for name, command in group.commands.items():
        words = (*above, name)
        found += commands(command, words) if hasattr(command, "commands") else [(words, command)]
    return found


OPTIONS = [
    (words, param.opts[0], param.is_flag, param.multiple)
    for words, command in commands(typer.main.get_command(app))
    for param in command.params
    if param.param_type_name == "option"
]
ONCE = list({option: (words, option, flag) for words, option, flag, several in OPTIONS if not several}.values())


@pytest.mark.parametrize(("words", "option", "flag"), ONCE, ids=lambda value: str(value).replace(" ", ""))
def test_an_option_given_twice_is_refused(words: tuple[str, ...], option: str, flag: bool, capsys) -> None:
    given = [option] if flag else [option, "3"]
    assert run([*words, *given, *given]) == 2
    shown = capsys.readouterr()
    place = json.loads(shown.out)["error"]["place"] if option == "--json" else shown.err.split(": ")[1]
    assert place == option


TWICE = {
    "generate cross --seeds 1 --out x --set camera.fps=5 --set camera.fps=7": ("camera.fps", "5 and 7"),
    "generate cross --seeds 1 --out x --set camera.fps=5 --set scenario.camera.fps=5": ("camera.fps", "5 and 5"),
    "generate cross --seeds 1 --out x --set sensor.clutter_rate=1 --set sensor.clutter_rate=2": (
        "sensor.clutter_rate", "1 and 2",
    ),
    "track blob x --out y --set gate=0.9 --set tracker.gate=0.99": ("gate", "0.9 and 0.99"),
    "tune blob --trials 3 --out x --suite quick --set gate=0.9 --set gate=0.8": ("gate", "0.9 and 0.8"),
    "replay x --seeds 1 --out y --set camera.fps=5 --set camera.fps=7": ("camera.fps", "5 and 7"),
}  # fmt: skip


@pytest.mark.parametrize("line", TWICE)
def test_a_key_given_twice_is_refused(line: str, tmp_path: Path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    key, values = TWICE[line]
    assert run(line.split()) == 2
    assert f"error: --set {key}: got it twice: {values};" in capsys.readouterr().err


NUMBERS = {
    "generate cross --out x --seeds {}": ("--seeds", "1_0", "1:3"),
    "track blob x --out y --seed {}": ("--seed", "1_0", "7"),
    "track blob x --out y --fps {}": ("--fps", "1_0", "2_5.5", "25"),
    "track blob x --out y --background {}": ("--background", "first:1_0", "first:10"),
    "export webdataset x --out y --shard-size {}": ("--shard-size", "1_0MB", "10MB"),
}


@pytest.mark.parametrize(("line", "text"), [(line, text) for line, (_, *texts) in NUMBERS.items() for text in texts])
def test_a_number_is_written_in_digits_0_to_9(line: str, text: str, tmp_path: Path, capsys, monkeypatch) -> None:
    """Underscores, and Arabic digits in numbers without one, are refused before the source is looked for."""
    monkeypatch.chdir(tmp_path)
    given = text if "_" in text else text.translate(ARABIC)
    assert run(line.format(given).split()) == 2
    shown = capsys.readouterr().err
    assert NUMBERS[line][0] in shown
    assert "expected no exception" not in shown
    assert shown.count("\n") == 1


@pytest.mark.parametrize(
    ("line", "place"), [("export csv x --out ~", "--out"), ("score x ~", "TRACKS"), ("group ~ --out x", "SOURCE")]
)
def test_an_empty_value_is_refused(line, place, capsys) -> None:
    """`--out "$OUT"` without that variable would write into the working folder."""
    assert run([word.strip("~") for word in line.split()]) == 2
    assert re.search(rf"{place}.*: got ''; expected a value", capsys.readouterr().err)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene, a dataset of it with two sequences and without pictures, and a run on it."""
    folder = tmp_path_factory.mktemp("mistakes")
    write_short_scene(folder, "0:2")
    assert run(["track", "blob", str(folder / "data"), "--out", str(folder / "run")]) == 0
    (folder / "people.ndjson").write_text('{"track": {"f": 1, "p": 1, "x": 8.46, "y": 3.59}}\n')
    return folder


MISTAKES = {
    "score {0}/data {0}/data": (
        "{0}/data: got a generated dataset, no tracks;", "give the --out of `flockscope track`",
    ),
    "score {0}/data {0}/run {0}/data": ("got a generated dataset, no tracks;",),
    "score {0}/run {0}/data": ("{0}/run: got tracks, what `flockscope track` wrote;", "swap the arguments"),
    "view {0}/run {0}/data --out {0}/x": ("{0}/run: got tracks, what", "swap the arguments"),
    "score {0}/data {0}/scene.toml": ("{0}/scene.toml: got a .toml file, no tracks;", "made by `flockscope track`"),
    "score {0}/data {0}/people.ndjson": ("{0}/people.ndjson: got a .ndjson file, no tracks;", "or MOTChallenge text"),
    "track blob {0}/data --detections image --out {0}/x": (
        "and scene-s00000 with detections, truth, without pictures; expected a sequence with pictures;",
        "try --detections file",
    ),
    "track blob {0}/data --camera {0}/scene.toml --out {0}/x": (
        "{0}/scene.toml: --camera: got a TOML file; expected a camera.json", "describes a view",
    ),
    "generate crossing --seeds 0": ("flockscope generate: got missing option '--out'; expected --out DIR: ",),
    "score {0}/data {0}/run {0}/run": ("TRACKS: got", "twice; expected each run once",),
    "score {0}/data {0}/run {0}/run/scene-s00000 --by HOTAA": ("--by: got HOTAA", "such as HOTA"),
    "score {0}/data {0}/run --by HOTA": ("--by: got one run; expected several",),
    "score {0}/data {0}/run --csv {0}/x.csv": ("--csv: got one run; expected several",),
    "score {0}/data {0}/run {0}/run/scene-s00000 --csv {0}/x.toml": ("--csv: got", "ends in .csv"),
    "export coco {0}/data --out {0}/scene.toml": ("--out: got", "ends in .json"),
    "replay {0}/data --out {0}/x --duration nan": ("--duration: got nan; expected seconds above 0",),
    "export csv {0}/data --out {0}/x --line a=nan,2,3,4": ("--line: got 'a=nan,2,3,4'",),
}  # fmt: skip


@pytest.mark.parametrize("line", MISTAKES)
def test_a_mistaken_argument_is_named(line: str, place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([word.format(place) for word in line.split()]) == 2
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    for words in MISTAKES[line]:
        assert words.format(place) in shown, shown
