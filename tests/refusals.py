"""A command that refuses its input: exit code 2 and one line; and one that answers with an object."""

from __future__ import annotations

import json

from tracking.app.cli import run


def refused(capsys, *words: object) -> str:
    """The line that a command prints, which must be the only one."""
    capsys.readouterr()
    assert run([str(word) for word in words]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    return line


def answer(capsys, *words: object) -> dict:
    """The object that a command with --json prints, which must succeed."""
    capsys.readouterr()
    code = run([*map(str, words), "--json"])
    found = json.loads(capsys.readouterr().out)
    assert code == 0, found
    return found
