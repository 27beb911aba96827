"""Runs the commands of README.md as they are written, with fewer seeds and trials and less frames per second."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from tests.small_videos import picture, write_video
from tracking.app.cli import run

README = (Path(__file__).resolve().parents[3] / "README.md").read_text(encoding="utf-8")


FEW = shlex.split("--seeds 0 --validation 10000 --test 20000 --check none --set scenario.camera.fps=5 --only gate")


def blocks(language: str) -> list[str]:
    """The fenced blocks of a language ("" for none)."""
    found = re.findall(r"^```(\w*)\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
    return [body for kind, body in found if kind == language]


@pytest.mark.slow
def test_commands(tmp_path, monkeypatch, capsys):
    """In their order, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    write_video(tmp_path / "street.mp4", [picture(k) for k in range(110)])
    lines = [line for block in blocks("") for line in block.splitlines() if line.startswith("flockscope ")]
    assert len(lines) >= 6
    for line in lines:
        words = shlex.split(line, comments=True)[1:]
        words += {"generate": ["--set", "camera.fps=5"], "tune": FEW}.get(words[0], [])
        assert run([{"0:10": "0:1", "100": "2"}.get(word, word) for word in words]) == 0, (
            line,
            capsys.readouterr().err,
        )
    assert (tmp_path / "plan.svg").is_file()
    for made in ("replay.html", "replay.mp4", "street-tracked.mp4"):
        assert (tmp_path / made).is_file()


@pytest.mark.slow
@pytest.mark.parametrize("code", blocks("python"), ids=["a scene", "own arrays"])
def test_python(code, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rows = [[f, p, 1.2 * f / 10 + p % 2, p, 1 + p // 3] for f in range(1, 41) for p in range(1, 5)]
    for name in ("truth", "mine"):
        np.savetxt(f"{name}.csv", rows, delimiter=",")
    exec(compile(code, "README.md", "exec"), {})
    assert "HOTA" in capsys.readouterr().out


def test_links():
    """Every relative link leads somewhere."""
    links = [link for link in re.findall(r"\]\(([^)#]+)[^)]*\)", README) if "://" not in link]
    assert len(links) >= 5
    assert all((Path(__file__).resolve().parents[3] / link).exists() for link in links), links
