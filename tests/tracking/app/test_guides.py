"""Runs a guide from top to bottom in an empty folder: its scripts, files and commands, and compares what it prints."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from tracking.app.cli import run

GUIDES = Path(__file__).resolve().parents[3] / "docs" / "guides"
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
SAVED = re.compile(r"Save this as `([^`]+)`")


def play(text: str, data: bool, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Runs the blocks in order and returns the commands that ran. data: also those that read the folder `data`.

    python: a script. toml: a file, named in the text before it. text: what the last command printed, to the letter.
    """
    done, printed, end = [], "", 0
    for block in BLOCK.finditer(text):
        kind, body, before, end = block[1], block[2], text[end : block.start()], block.end()
        if kind == "python":
            exec(compile(body, "guide", "exec"), {})
        elif kind == "toml":
            Path(SAVED.findall(before)[-1]).write_text(body)
        elif kind == "text":
            assert "\n".join(map(str.rstrip, printed.splitlines())) == body.rstrip("\n"), done[-1]
        elif data or "data/" not in body:
            for line in body.splitlines():
                capsys.readouterr()
                assert run(shlex.split(line, comments=True)[1:]) == 0, (line, capsys.readouterr().err)
                printed = capsys.readouterr().out
                done.append(line)
    return done


def test_who_belongs_together(tmp_path, monkeypatch, capsys):
    """Without recordings."""
    monkeypatch.chdir(tmp_path)
    text = (GUIDES / "who-belongs-together.md").read_text(encoding="utf-8")
    assert len(play(text, False, capsys)) >= 2
    assert (tmp_path / "walk.html").is_file()


def test_who_belongs_together_in_recordings(tmp_path, monkeypatch, capsys, shared_data):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(shared_data)
    text = (GUIDES / "who-belongs-together.md").read_text(encoding="utf-8")
    done = play(text, True, capsys)
    assert len(done) == len(re.findall("^flockscope ", text, re.MULTILINE))
