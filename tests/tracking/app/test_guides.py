"""Runs guides from top to bottom in an empty folder, and compares what they print; runs README with fewer seeds.

`pytest tests/tracking/app/test_guides.py --write-guides` writes what is printed into the guides.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from difflib import SequenceMatcher
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.small_videos import picture, write_video
from tracking.app.cli import run

GUIDES = Path(__file__).resolve().parents[3] / "docs" / "guides"
README = (Path(__file__).resolve().parents[3] / "README.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
SAVED = re.compile(r"Save this as `([^`]+)`")


def play(
    text: str, data: bool, capsys: pytest.CaptureFixture[str], again: list[str] | None = None,
    scripts: list[str] | None = None,
) -> list[str]:  # fmt: skip
    """Runs the blocks in order and returns the commands that ran. data: also those that read the folder `data`.

    again: receives what stands in place of each text, which is then not compared. scripts: receives what python prints.

    A block whose preceding text says "Save this as" becomes a file. Others: python is a script, text is what the last
    command or script printed, to the letter but for lines that a line "…" stands for, sh is not run, and lines of a
    block without a language are commands.
    """
    done, printed, end, scripts = [], "", 0, [] if scripts is None else scripts
    for block in BLOCK.finditer(text):
        kind, body, before, end = block[1], block[2], text[end : block.start()], block.end()
        if saved := SAVED.findall(before):
            Path(saved[-1]).write_text(body)
        elif kind == "python":
            capsys.readouterr()
            exec(compile(body, "guide", "exec"), {})
            printed = capsys.readouterr().out or printed
            scripts.append(printed)
        elif kind == "text":
            shown = "\n".join(map(str.rstrip, printed.splitlines()))
            if again is None:
                assert shows(body.rstrip("\n"), shown), f"{done[-1]} printed:\n{shown}"
            else:
                again.append(printed_again(body, shown) + "\n")
        elif not kind and (data or "data/" not in body):
            for line in body.splitlines():
                capsys.readouterr()
                command, _, file = line.partition(" > ")
                assert run(shlex.split(command, comments=True)[1:]) == 0, (line, capsys.readouterr().err)
                printed = capsys.readouterr().out
                if file:
                    Path(file).write_text(printed)
                done.append(line)
    return done


def shows(body: str, printed: str) -> bool:
    """Returns True if a text is what was printed; a line "…" of it stands for one or more lines."""
    lines = (".*" if line == "…" else re.escape(line) for line in body.splitlines())
    return re.fullmatch("\n".join(lines), printed, re.DOTALL) is not None


def printed_again(body: str, printed: str) -> str:
    """Returns the part of a printed text that a body with lines "…" shows, by the most similar lines."""
    lines, out, start = printed.splitlines(), list[str](), 0
    stretches = [part.splitlines() for part in re.split(r"^…$\n?", body, flags=re.MULTILINE)]
    for k, part in enumerate(stretches):
        if k == len(stretches) - 1 and k and part:  # the last stretch ends the text
            start = max(start, len(lines) - len(part))
        elif k and part:
            likeness = [SequenceMatcher(None, part[0], line).ratio() for line in lines[start:]]
            start += likeness.index(max(likeness))
        end = len(lines) if len(stretches) == 1 else start + len(part)
        out += ([] if k == 0 else ["…"]) + lines[start:end]
        start = end
    return "\n".join(out)


def test_printed_again():
    assert printed_again("a 1\nb 1\n…\nd 1\n", "a 2\nb 2\nc 2\nc 3\nd 2") == "a 2\nb 2\n…\nd 2"
    assert printed_again("a 1\n…\nseed 1\n…\n", "a 2\nc 2\nseed 2\ne") == "a 2\n…\nseed 2\n…"
    assert printed_again("a\n", "b\nc") == "b\nc"


def follow(name: str, data: bool, capsys: pytest.CaptureFixture[str]) -> None:
    """Plays a guide; with data, all its commands must have run. With --write-guides its texts are written again."""
    page = GUIDES / f"{name}.md"
    text = page.read_text(encoding="utf-8")
    again = list[str]() if capsys.request.config.getoption("--write-guides") else None
    done = play(text, data, capsys, again)
    if again is not None:
        texts = iter(again)
        page.write_text(BLOCK.sub(lambda b: f"```text\n{next(texts)}```" if b[1] == "text" else b[0], text), "utf-8")
    assert len(done) >= 2 or name == "python"
    if data:
        unrun = re.sub(r"^```sh\n.*?^```$", "", text, flags=re.DOTALL | re.MULTILINE)
        assert len(done) == len(re.findall("^flockscope ", unrun, re.MULTILINE))


def test_shows():
    assert shows("a\n…\nd (1)", "a\nb\nc\nd (1)")
    assert not shows("a\n…\nd (1)", "a\nb\nc\nd (2)")


def test_who_belongs_together(tmp_path, monkeypatch, capsys):
    """Without recordings."""
    monkeypatch.chdir(tmp_path)
    follow("who-belongs-together", False, capsys)
    assert (tmp_path / "walk.html").is_file()


def test_live(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shown = list[str]()
    text = (GUIDES / "live.md").read_text(encoding="utf-8")
    assert not play(text, False, capsys, scripts=shown), "its commands need cameras"
    printed = "".join(shown)
    assert " s: " in printed
    assert "[1, 2]" in printed


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["../start/first-ten-minutes", "generate", "write-a-scenario", "track-and-score", "your-own-tracker", "python"],
)
def test_without_recordings(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    follow(name, False, capsys)


def test_train_an_agent(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    follow("train-an-agent", False, capsys)


def test_train_on_it(tmp_path, monkeypatch, capsys):
    """Blocks of "py" need packages of others, and run where these are installed."""
    monkeypatch.chdir(tmp_path)
    follow("train-on-it", False, capsys)
    text = (GUIDES / "train-on-it.md").read_text(encoding="utf-8")
    blocks = [block[2] for block in BLOCK.finditer(text) if block[1] == "py"]
    assert len(blocks) == 3
    for body in blocks:
        if all(find_spec(name) for name in re.findall(r"\b(pycocotools|supervision|webdataset)\b", body)):
            subprocess.run([sys.executable, "-c", body], check=True)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["where-it-breaks", "gate"])
def test_with_the_class_of_another_guide(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text = (GUIDES / "your-own-tracker.md").read_text(encoding="utf-8")
    code = next(block[2] for block in BLOCK.finditer(text) if "class Nearest" in block[2])
    (tmp_path / "nearest.py").write_text(code)
    follow(name, False, capsys)


@pytest.mark.parametrize("name", ["who-belongs-together", "recordings", pytest.param("tune", marks=pytest.mark.slow)])
def test_with_recordings(name, tmp_path, monkeypatch, capsys, shared_data):
    """The folder `data` of the guides, and a video of the reader's."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(shared_data)
    write_video(tmp_path / "street.mp4", [picture(k) for k in range(110)])
    follow(name, True, capsys)


FEW = shlex.split("--seeds 0 --validation 10000 --test 20000 --check none --set scenario.camera.fps=5 --only gate")


def blocks(language: str) -> list[str]:
    """The fenced blocks of a language ("" for none)."""
    found = re.findall(r"^```(\w*)\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
    return [body for kind, body in found if kind == language]


@pytest.mark.slow
def test_commands_of_the_readme(tmp_path, monkeypatch, capsys):
    """In their order, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    write_video(tmp_path / "street.mp4", [picture(k) for k in range(110)])
    (tmp_path / "walks.csv").write_text("".join(f"{k},{p},{k / 10},{p}\n" for k in range(1, 111) for p in (1, 2)))
    (tmp_path / "det.txt").write_text("".join(f"{k},-1,{k / 2},20,16,40,0.9\n" for k in range(1, 111)))
    lines = [line for block in blocks("") for line in block.splitlines() if line.startswith("flockscope ")]
    lines = [line for line in lines if "rtsp:" not in line]
    assert len(lines) >= 6
    for line in lines:
        words = shlex.split(line, comments=True)[1:]
        fps = ["--set", "camera.fps=5"]
        words += {"generate": fps, "tune": FEW, "stress": [*fps, "--episodes", "20"]}.get(words[0], [])
        assert run([{"0:10": "0:1", "100": "2"}.get(word, word) for word in words]) == 0, (
            line,
            capsys.readouterr().err,
        )
    assert (tmp_path / "plan.svg").is_file()
    assert (tmp_path / "report" / "index.html").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("code", blocks("python"))
def test_python_of_the_readme(code, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "README.md", "exec"), {})
    assert "HOTA" in capsys.readouterr().out
