"""What a command prints of files and arguments is text: never markup, never commands to the terminal."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from scenarios.errors import InputError
from sim.store.seal import read_manifest, with_hash
from tests.processes import ROOT
from tests.short_scene import SCENE
from tracking.app import progress
from tracking.app.cli import run
from tracking.app.command_line import _print_warnings_once
from tracking.app.command_result import CommandResult, print_error, print_result
from tracking.app.progress import ProgressMeter
from tracking.app.score_tables import table

NAMES = ("[/red]", "x[door]y", ":smile:", "\x1b[31mred", "a\u202eb", "[link=http://x]y[/link]")
SHOWN = ("[/red]", "x[door]y", ":smile:", "\\x1b[31mred", "a\\u202eb", "[link=http://x]y[/link]")


@pytest.mark.parametrize(("name", "shown"), [*zip(NAMES, SHOWN, strict=True)])
def test_text_tables_errors_warnings_and_progress_show_names_letter_by_letter(name, shown, capsys, monkeypatch):
    print_result(CommandResult({}, f"first\n{name}\n{table('', [name], (), [[name]])}"), as_json=False)
    print_error(InputError(got=name, expected="a", remedy="b"), as_json=False)
    _print_warnings_once()(UserWarning(name))
    monkeypatch.setattr(progress, "PAUSE", -1.0)
    with ProgressMeter("track", 2) as meter:
        meter._last_line = 0.0
        meter.step(name)
    printed = capsys.readouterr()
    assert printed.out == "first\n" + f"{shown}\n" * 3
    assert printed.err.splitlines() == [
        f"error: got {shown}; expected a; b", f"warning: {shown}", f"track: 1 of 2 {shown}",
    ]  # fmt: skip


def test_labels_and_detections_of_a_folder_give_one_warning(capsys):
    warn = _print_warnings_once()
    for name in ("a/gt/gt", "a/det/det", "b/gt/gt"):
        warn(UserWarning(f"{name}.txt: {len(name)} rows of class 2 are left out"))
    assert len(capsys.readouterr().err.splitlines()) == 2


@pytest.mark.parametrize("name", [*NAMES, "\udcff", "\x9b", "\U000e0041", "\u2028"])
def test_json_holds_names_whole_and_as_escapes(name, capsys):
    print_result(CommandResult({"name": name}), as_json=True)
    (line,) = capsys.readouterr().out.splitlines()
    assert json.loads(line)["name"] == name
    assert line.isprintable()


@pytest.fixture(scope="module")
def broken_name(tmp_path_factory) -> Path:
    """A dataset of four sequences, one with line breaks in the name that its manifest states; its tracks."""
    folder = tmp_path_factory.mktemp("broken")
    (folder / "scene.toml").write_text(SCENE)
    words = ["generate", str(folder / "scene.toml"), "--seeds", "20000:20004", "--streams", "left"]
    assert run([*words, "--set", "camera.image=[128,96]", "--out", str(folder / "data")]) == 0
    first = next((folder / "data").rglob("*s20000"))
    manifest = read_manifest(first)
    manifest["sequence"]["name"] = "walk\nHOTA 1.000\r\n"
    (first / "manifest.json").write_text(json.dumps(with_hash(manifest)))
    assert run(["track", "blob", str(folder / "data"), "--detections", "file", "--out", str(folder / "tracks")]) == 0
    return folder


LINES_WITH_NAMES = [
    "track blob {0}/data --detections file --out {1}", "score {0}/data {0}/tracks",
    "score {0}/data {0}/tracks {0}/tracks/.", "fit sensor {0}/data --out {1}/sensor.toml",
    "view {0}/data --video none --out {1}", "sheet {0}/data --out {1}", "validate {0}/tracks",
]  # fmt: skip


@pytest.mark.parametrize("line", LINES_WITH_NAMES)
def test_a_line_break_in_a_name_makes_no_row(line, broken_name, tmp_path, capsys):
    capsys.readouterr()
    assert run([word.format(broken_name, tmp_path / "out") for word in line.split()]) == 0
    shown = capsys.readouterr().out
    assert not any(row.lstrip().startswith("HOTA 1.000") for row in shown.splitlines())
    if line.split()[0] in ("score", "fit"):  # track prints one line for all four sequences
        assert "walk\\nHOTA 1.000\\r\\n" in shown


def _command(*words: str | bytes, text: bool = True, **env: str) -> subprocess.CompletedProcess:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **env}
    line = [sys.executable, "-m", "tracking.app.cli", *words]
    return subprocess.run(line, env=environment, capture_output=True, check=False, text=text)


TERMINALS = [
    {"LC_ALL": "C"}, {"LC_ALL": "POSIX", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
    {"PYTHONIOENCODING": "ascii"}, {"TERM": ""}, {"PYTHONOPTIMIZE": "1"},
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("env", TERMINALS, ids=lambda env: next(iter(env)) + "=" + next(iter(env.values())))
def test_any_terminal_and_locale(env):
    """A character that the terminal's encoding lacks is printed as an escape."""
    shown = _command("scenarios", "crossing", **env)
    assert (shown.returncode, shown.stderr) == (0, "")
    refused = _command("scenarios", "Zürich", "--json", **env)
    assert refused.returncode == 2
    got = json.loads(refused.stdout)["error"]["got"]
    assert "PYTHONUTF8" in env or "Zürich" in got  # an ASCII command line has no ü
    refused = _command("scenarios", b"\xff\x1b[31m.toml", **env)
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1
    assert "\x1b" not in refused.stderr


def test_progress_tells_how_long_the_rest_takes(capsys, monkeypatch):
    """The first item, in which code is compiled, does not count; before 5 % more are done nothing is told."""
    now = [0.0]
    monkeypatch.setattr(progress, "PAUSE", -1.0)
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with ProgressMeter("demo", 100) as meter:
        meter._last_line = 0.0
        for seconds, count in ((43.0, 2), (1.0, 4), (1.0, 1), (63.0, 63)):
            now[0] += seconds
            meter.step("blob", count)
    assert capsys.readouterr().err.splitlines() == [
        "demo: 2 of 100 blob", "demo: 6 of 100 blob", "demo: 7 of 100 blob (0:37 left)",
        "demo: 70 of 100 blob (0:28 left)",
    ]  # fmt: skip
