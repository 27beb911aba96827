"""A command that refuses its input: an exit code and one line; and one that answers with an object."""

from __future__ import annotations

import json

from tracking.app.cli import run


def refused(capsys, *words: object, code: int = 2) -> str:
    """The line that a command prints, which must be the only one but for warnings."""
    capsys.readouterr()
    assert run([str(word) for word in words]) == code
    printed = capsys.readouterr()
    assert printed.out == ""
    (line,) = [row for row in printed.err.splitlines() if not row.startswith("warning: ")]
    return line


def answer(capsys, *words: object) -> dict:
    """The object that a command with --json prints, which must succeed."""
    capsys.readouterr()
    code = run([*map(str, words), "--json"])
    found = json.loads(capsys.readouterr().out)
    assert code == 0, found
    return found
