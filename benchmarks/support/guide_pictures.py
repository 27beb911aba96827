"""Pictures of the guides and of the gallery: a curve, verdicts, contact sheets, replays."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from benchmarks.support.chart import COLOURS, Panel, lines
from benchmarks.support.idea_pictures import figure_of, save
from tracking.app.cli import run
from tracking.app.pictures.contact_sheet import write_sheet
from tracking.export.labelled_pictures import labelled_pictures
from tracking.recordings.source import open_source
from tracking.recordings.track_texts import read_tracks

SCENES = {"split": "blob", "cross": "relational", "queue": "joint"}
"""Scenarios of the gallery, and who tracks them."""


def write(docs: Path) -> Iterator[Path]:
    """Writes all pictures and the data of replays, and yields their paths."""
    yield curve(docs / "guides" / "where-it-breaks.md", docs / "guides" / "where-it-breaks.svg")
    yield verdicts(docs / "guides" / "gate.svg")
    with tempfile.TemporaryDirectory() as folder:
        yield from scenes(Path(folder), docs)


def curve(guide: Path, out: Path) -> Path:
    """Draws the table of shares that the guide shows."""
    text = guide.read_text(encoding="utf-8")
    table = re.search(r"^share of the oracle, .*\n(.*)\n((?:[ \d.]+ ±.*\n)+)", text, re.MULTILINE)
    assert table is not None
    names = table[1].split()[1:]
    rows = np.array([re.findall(r"[\d.]+", line) for line in table[2].splitlines()], float)
    mean, half = rows[:, 1::2].T, rows[:, 2::2].T
    curves = {name: (m, m - h, m + h) for name, m, h in zip(names, mean, half, strict=True)}
    panel = Panel("Share of the oracle's objective", rows[:, 0], curves, "probability of detection")
    return lines([panel], out)


def verdicts(out: Path) -> Path:
    """Draws an interval for each verdict of `compare`."""
    figure, (axes,) = figure_of(1, 6.4, 2.3)
    cases = {
        "regression": (-0.045, 0.02, COLOURS[1]),
        "too noisy": (-0.012, 0.03, "#5c5c5c"),
        "no difference": (0.001, 0.006, COLOURS[0]),
        "improvement": (0.04, 0.018, COLOURS[2]),
    }
    axes.axvspan(-0.01, 0.01, color="#dcdfe4", zorder=0)
    axes.axvline(0, color="#8a8f98", linewidth=1)
    for row, (middle, half, ink) in enumerate(cases.values()):
        axes.errorbar(middle, -row, xerr=half, fmt="o", color=ink, capsize=4, linewidth=2)
    axes.set_yticks([-row for row in range(len(cases))], list(cases))
    axes.set(xlabel="score now minus score of the baseline, 95 % interval; grey: the tolerance", ylim=(-3.6, 0.6))
    save(figure, out)
    return out


def scenes(folder: Path, docs: Path) -> Iterator[Path]:
    """Makes sheets and the data of replays of the gallery, and the sheets of two tutorials."""
    for name, tracker in SCENES.items():
        made, tracks, replay = folder / name, folder / f"{name}-tracks", folder / f"{name}.html"
        command("generate", name, "--seeds", "40000", "--set", "camera.fps=5", "--out", made)
        command("track", tracker, made, "--detections", "file", "--out", tracks)
        yield sheet(made, docs / "start" / f"{name}.jpg", 3, tracks)
        plain = folder / f"{name}-plain"
        command("generate", name, "--seeds", "40000", "--set", "camera.fps=5", "--streams", "none", "--out", plain)
        command("view", plain / "flockscope-demo" / f"{name}-s40000", f"{tracker}={tracks}", "--out", replay)
        yield data_of(replay, docs / "start" / f"{name}.json")
    for name, seed, out in (("single-file", "40000", "start/single-file.jpg"), ("merge", "0", "guides/sheet.jpg")):
        made = folder / f"{name}-sheet"
        command("generate", name, "--seeds", seed, "--set", "camera.fps=5", "--out", made)
        yield sheet(made, docs / out, 4)
    command("track", "blob", made, "--detections", "file", "--out", folder / "boxes")
    yield sheet(made, docs / "start" / "first-ten-minutes.jpg", 3, folder / "boxes")
    crowd = folder / "labels"
    some = ["--set", "camera.fps=5", "--set", "duration=8", "--streams", "left,ids"]
    command("generate", "crowd", "--seeds", "40000", *some, "--out", crowd)
    yield labels(crowd, docs / "guides" / "labels.jpg")


def labels(dataset: Path, out: Path) -> Path:
    """Draws a frame with ignored people: boxes of those who count and of those who are ignored, beside their masks."""
    (labelled,) = labelled_pictures(dataset, 0.4)
    frames = [labelled.people(k) for k in range(1, labelled.truth.length + 1)]
    index = int(np.argmax([people.ignored.sum() for people in frames]))
    boxed = next(f.image for f in labelled.sequence if f.index == index + 1).copy()
    masked, people, r = boxed.copy(), frames[index], np.random.default_rng(0)
    assert people.ids is not None
    for person, part, ignored in zip(people.id, people.part.round().astype(int).tolist(), people.ignored, strict=True):
        ink = (60, 60, 255) if ignored else (60, 220, 255)
        cv2.rectangle(boxed, tuple(part[:2]), tuple(part[2:]), ink, 1, cv2.LINE_AA)
        shown = people.ids == person
        paint = (60, 60, 255) if ignored else r.integers(90, 255, 3)
        masked[shown] = (0.35 * masked[shown] + 0.65 * np.array(paint)).astype(np.uint8)
    cv2.imwrite(str(out), np.hstack([boxed, masked]), [cv2.IMWRITE_JPEG_QUALITY, 72])
    return out


def data_of(replay: Path, out: Path) -> Path:
    """Writes the data that a replay page shows; docs/conf.py puts it into the page of today."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', replay.read_text(encoding="utf-8"))
    assert found is not None
    out.write_text(f"{found[1]}\n", encoding="utf-8")
    return out


def sheet(dataset: Path, out: Path, frames: int, run_of: Path | None = None) -> Path:
    """Writes the contact sheet of the sequence of a dataset as JPEG."""
    (sequence,) = open_source(dataset)
    tracks = None if run_of is None else read_tracks(run_of / sequence.name)
    drawn = write_sheet(sequence, dataset / "sheet.png", frames, tracks)
    picture = cv2.imread(str(drawn))
    scale = (400 + 150 * frames) / picture.shape[1]
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    out.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(out), small, [cv2.IMWRITE_JPEG_QUALITY, 72])
    return out


def command(*words: object) -> None:
    """Runs a command of flockscope. Raises SystemExit if it fails."""
    if run([str(word) for word in words]):
        raise SystemExit(f"flockscope {' '.join(map(str, words))} failed")
