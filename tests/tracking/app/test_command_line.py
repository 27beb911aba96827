"""What click accepts in silence is an error: an option or a key given twice, an empty value; seeds in other digits."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.commands import commands
from tests.refusals import refused
from tracking.app.cli import run

ARABIC = str.maketrans("0123456789", "٠١٢٣٤٥٦٧٨٩")


OPTIONS = [
    (words, param.opts[0], param.is_flag, param.multiple)
    for words, command in commands().items()
    for param in command.params
    if param.param_type_name == "option"
]
ONCE = list({option: (words, option, flag) for words, option, flag, several in OPTIONS if not several}.values())


def test_an_option_names_its_value_in_plain_words() -> None:
    """Choices are shown as they are; of other values no type of Python."""
    shown = {
        param.opts[0]: param.display_type_rich(command.context_class(command))
        for command in commands().values()
        for param in command.params
        if param.param_type_name == "option" and not param.is_flag
    }
    assert shown["--workers"] == "N"
    assert shown["--fps"] == "X"
    assert shown["--similarity"] == "<boxes|ground|image>"
    assert not [value for value in shown.values() if re.search("int|float|str|path|list", value)]


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
    "track blob x --out y --set gate=0.9 --set tracker.gate=0.99": ("gate", "0.9 and 0.99"),
    "tune blob --trials 3 --out x --suite quick --set gate=0.9 --set gate=0.8": ("gate", "0.9 and 0.8"),
    "replay x --seeds 1 --out y --set camera.fps=5 --set camera.fps=7": ("camera.fps", "5 and 7"),
}  # fmt: skip


@pytest.mark.parametrize("line", TWICE)
def test_a_key_given_twice_is_refused(line: str, tmp_path: Path, capsys, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    key, values = TWICE[line]
    assert f"error: --set {key}: got it twice: {values};" in refused(capsys, *line.split())


NUMBERS = {
    "generate cross --out x --seeds {}": ("--seeds", "1_0", "1:3"),
    "track blob x --out y --background {}": ("--background", "first:1_0", "first:10"),
    "export webdataset x --out y --shard-size {}": ("--shard-size", "1_0MB", "10MB"),
}


@pytest.mark.parametrize(("line", "text"), [(line, text) for line, (_, *texts) in NUMBERS.items() for text in texts])
def test_a_number_is_written_in_digits_0_to_9(line: str, text: str, tmp_path: Path, capsys, monkeypatch) -> None:
    """Underscores, and Arabic digits in numbers without one, are refused before the source is looked for."""
    monkeypatch.chdir(tmp_path)
    given = text if "_" in text else text.translate(ARABIC)
    shown = refused(capsys, *line.format(given).split())
    assert NUMBERS[line][0] in shown
    assert "expected no exception" not in shown


@pytest.mark.parametrize(
    ("line", "place"), [("export csv x --out ~", "--out"), ("score x ~", "TRACKS"), ("group ~ --out x", "SOURCE")]
)
def test_an_empty_value_is_refused(line, place, capsys) -> None:
    """`--out "$OUT"` without that variable would write into the working folder."""
    shown = refused(capsys, *[word.strip("~") for word in line.split()])
    assert re.search(rf"{place}.*: got ''; expected a value", shown)
