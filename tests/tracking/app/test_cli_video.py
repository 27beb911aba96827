"""Pictures through the command line: what works, and what users get wrong, in one clear line each."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests.recordings import mot_folder
from tests.refusals import refused
from tests.small_videos import SIZE, damage, picture, write_video
from tracking.app.cli import run


def film(folder: Path, n: int = 60, name: str = "film.mp4", **more) -> Path:
    return write_video(folder / name, [picture(k) for k in range(n)], **more)


def jpegs(folder: Path, pictures: list[np.ndarray], suffix: str = ".jpg") -> Path:
    return mot_folder(folder, pictures={f"img1/{k:06d}{suffix}": image for k, image in enumerate(pictures, 1)})


def noise(k: int, size: tuple[int, int] = SIZE) -> np.ndarray:
    return np.random.default_rng(k).integers(0, 255, (size[1], size[0], 3), dtype=np.uint8)


def text(path: Path) -> Path:
    path.write_text("hello")
    return path


def sixteen(k: int) -> np.ndarray:
    return picture(k).astype(np.uint16) * 257


# what is wrong with a video: how it is made, and what the line must say.
BROKEN: dict[str, tuple[Callable[[Path], Path], list[str]]] = {
    "no video": (lambda f: text(f / "a.mp4"), ["a.mp4", "no readable video"]),
    "too short for any background": (lambda f: film(f, 6), ["film.mp4", "at least 10 frames"]),
    "every pixel changes": (
        lambda f: jpegs(f / "mot", [noise(k) for k in range(60)]),
        ["/mot: ", "no background can be learned"],
    ),
}  # fmt: skip


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_recording_is_one_line(name, tmp_path, capsys):
    make, expected = BROKEN[name]
    out = tmp_path / "out"
    error = refused(capsys, "track", "blob", make(tmp_path), "--fps", 10, "--px-per-m", 20, "--out", out)
    assert all(word in error for word in expected), error
    assert not out.exists()


# pictures that are strange, and yet pictures: how they are made, and what a warning must say.
STRANGE: dict[str, tuple[Callable[[Path], Path], str]] = {
    "plain": (film, ""),
    "16 bits": (lambda f: jpegs(f / "mot", [sixteen(k) for k in range(60)], ".png"), ""),
    "grey": (lambda f: jpegs(f / "mot", [picture(k)[..., 1] for k in range(60)]), ""),
    "damaged": (lambda f: damage(film(f), 0.7, 300), "lost"),
}


@pytest.mark.parametrize("name", STRANGE)
def test_strange_pictures_are_pictures(name, tmp_path, capsys):
    """Frames keep their slots: as many answers as there are frames."""
    make, word = STRANGE[name]
    line = ["track", "blob", str(make(tmp_path)), "--fps", "10", "--px-per-m", "20", "--out", str(tmp_path / "out")]
    assert run([*line, "--json"]) == 0
    printed = capsys.readouterr()
    (shown,) = json.loads(printed.out)["runs"]
    assert shown["detections"] == "image"
    assert not shown["causal"]
    assert word in printed.err
    if not word:
        assert shown["frames"] == 60
    for command in (["sheet"], ["view"], ["overlay"]):
        tracks = [] if command == ["sheet"] else [str(tmp_path / "out")]
        source, suffix = line[2], {"sheet": "png", "view": "html", "overlay": "mp4"}[command[0]]
        made = tmp_path / f"made.{suffix}"
        assert run([*command, source, *tracks, "--fps", "10", "--out", str(made)]) == 0, capsys.readouterr().err
        assert made.stat().st_size > 1000


def test_which_background_is_told(tmp_path, capsys):
    path, empty = str(film(tmp_path)), str(tmp_path / "empty.png")
    cv2.imwrite(empty, picture(0))
    for option, words, begins in (
        ([], "50 frames spread over the recording (not causal)", None),
        # groups depend on the ground, which is learned from all frames of so short a film
        (["--background", "first:20"], "first 20 frames (causal from frame 20)", 60),
        (["--background", "spread:30"], "30 frames spread over the recording (not causal)", None),
        (["--background", empty], "empty.png and 50 frames spread over the recording (not causal)", None),
    ):
        out = tmp_path / "out"
        assert run(["track", "blob", path, "--px-per-m", "20", "--out", str(out), *option]) == 0
        shown = json.loads((out / "run.json").read_text())
        assert (shown["background"], shown["causal_from"], shown["detections"]) == (words, begins, "image")
        assert shown["causal"] == (begins is not None)
        assert words in capsys.readouterr().out


OPTIONS = [
    ("--background last:5", ["--background", "last:5", "first:N"]),
    ("--background first:61", ["--background", "60 frames", "61"]),
    ("--background {}/nowhere.png", ["nowhere.png", "--background", "no such file", "check the path"]),
    ("--background {}/text.png", ["text.png", "--background", "no picture that can be read"]),
    ("--background {}/small.png", ["small.png", "--background", "64×96 px", "96×64 px", "the same size"]),
    ("--detections file", ["needs pixels or boxes", "film", "images"]),
    ("--detections image --set sensor.noise_m=3", ["sensor"]),
    ("--min-score 0.5", ["--min-score", "without --boxes", "it has no boxes"]),
]


@pytest.mark.parametrize(("option", "words"), OPTIONS)
def test_options_that_cannot_work(option, words, tmp_path, capsys, monkeypatch):
    """Before a frame is read."""
    path = film(tmp_path)
    text(tmp_path / "text.png")
    cv2.imwrite(str(tmp_path / "small.png"), np.swapaxes(picture(0), 0, 1))
    monkeypatch.setattr("sim.pictures.background_sample.BackgroundSample.__call__", None)
    line = refused(capsys, "track", "blob", path, "--out", tmp_path / "out", *option.format(tmp_path).split())
    assert all(word in line for word in words), line
    assert not (tmp_path / "out").exists()


def test_a_background_for_a_tracker_that_needs_none(tmp_path, capsys):
    folder = jpegs(tmp_path / "mot", [picture(k) for k in range(30)])
    mot_folder(folder, "".join(f"{k},1,{4 * k},20,16,16,1,1,1\n" for k in range(1, 30)))
    options = ["--detections", "truth", "--background", "first:10"]
    line = refused(capsys, "track", "blob", folder, "--fps", 10, *options, "--out", tmp_path / "out")
    assert "leave --background out" in line


BOXES_ONLY = (
    "class Mine:\n    needs = ('boxes',)\n    def reset(self, context, seed): ...\n    def step(self, f, d): ...\n"
)

# commands whose input lacks what they need: what the error must say
WITHOUT = {
    "track {0}/mine.py:Mine {0}/film.mp4 --out {0}/x": "give a detector's boxes with --boxes FILE",
    "track blob {0}/loose --out {0}/x": "move the pictures to {0}/loose/img1",
    "track blob {0}/boxes.json --out {0}/x": "if these are boxes: flockscope track TRACKER VIDEO --boxes",
    "errors {0}/film.mp4 {0}/run": "{0}/film.mp4: got no labels",
    "overlay {0}/film.mp4 {0}/other --out {0}/x.mp4": "a text that is named itself counts for any sequence",
}


@pytest.fixture(scope="module")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A video without labels, tracks of it and of its boxes alone, and what a user may take for a recording."""
    folder = tmp_path_factory.mktemp("street")
    film(folder)
    (folder / "mine.py").write_text(BOXES_ONLY)
    (folder / "boxes.json").write_text("[]")
    jpegs(folder, [picture(0), picture(1)]).joinpath("img1").rename(folder / "loose")
    (folder / "other.txt").write_text("".join(f"{k},-1,{10 + k},20,16,40,0.9\n" for k in range(1, 20)))
    for source, out in (("film.mp4", "run"), ("other.txt", "other")):
        assert run(["track", "blob", str(folder / source), "--px-per-m", "20", "--out", str(folder / out)]) == 0
    return folder


@pytest.mark.parametrize("line", WITHOUT)
def test_the_remedy_says_what_is_missing(line, street, capsys):
    assert WITHOUT[line].format(street) in refused(capsys, *line.format(street).split())


def test_a_sample_mostly_without_pictures_is_a_warning(tmp_path, capsys):
    shown = {f"img1/{k:06d}.jpg": picture(k) for k in (1, 2, *range(5, 122, 4))}
    folder = mot_folder(tmp_path / "mot", pictures=shown)
    line = ["track", "blob", str(folder), "--fps", "10", "--px-per-m", "20", "--out", str(tmp_path / "out")]
    assert run(line) == 0
    assert "of the 50 frames of the background sample have a readable picture; number the" in capsys.readouterr().err
