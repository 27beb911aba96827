"""A command that refuses its input: exit code 2 and one line."""

from __future__ import annotations

from tracking.app.cli import run


def refused(capsys, *words: object) -> str:
    """The line that a command prints, which must be the only one."""
    capsys.readouterr()
    assert run([str(word) for word in words]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    return line
