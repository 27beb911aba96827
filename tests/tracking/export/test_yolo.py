"""YOLO's layout: a label for each picture with boxes inside it, hidden people left out, splits side by side."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.store import sequence_folder
from tests.made_up import make_pictured, make_sequence
from tests.recordings import mot_folder
from tracking.export.yolo import yolo


def boxes(label: Path, size: tuple[int, int]) -> list[list[float]]:
    """Left, top, right, bottom in px of each line."""
    rows = np.array([line.split() for line in label.read_text().splitlines()], float).reshape(-1, 5)
    assert (rows[:, 0] == 0).all()
    assert ((rows[:, 1:] >= 0) & (rows[:, 1:] <= 1)).all()
    middle, half = rows[:, 1:3], rows[:, 3:] / 2
    return (np.hstack([middle - half, middle + half]) * [*size, *size]).tolist()


def test_a_recording(tmp_path: Path) -> None:
    rows = ["1,1,-4,40,10,20,1,1,0.3", "1,2,10,10,5,6,1,1,0.1", "1,3,70,10,5,6,1,1,1", "3,1,20,5,8,16,1,1,1"]
    pictures = {f"img1/{k:06d}.png": np.full((48, 64, 3), 9 * k, np.uint8) for k in (1, 2, 3)}
    source = mot_folder(tmp_path / "s", "\n".join(rows), ini="name=walk\nframeRate=5\n", pictures=pictures)
    made = yolo(source, tmp_path / "out")
    assert (made.pictures, made.kept, made.ignored) == (3, 2, 1)
    for k in (1, 2, 3):
        stem = f"train/walk-{k:06d}"
        assert (tmp_path / f"out/images/{stem}.png").read_bytes() == (source / f"img1/{k:06d}.png").read_bytes()
    labels = [boxes(path, (64, 48)) for path in sorted((tmp_path / "out/labels/train").iterdir())]
    assert labels == [[pytest.approx([0, 40, 6, 48], abs=1e-3)], [], [pytest.approx([20, 5, 28, 21], abs=1e-3)]]
    assert (tmp_path / "out/data.yaml").read_text() == "# flockscope\ntrain: images/train\nnames:\n  0: person\n"


@pytest.mark.filterwarnings("ignore:.*class")
def test_classes_of_people(tmp_path: Path) -> None:
    pictures = {"img1/000001.png": np.zeros((48, 64, 3), np.uint8)}
    rows = "\n".join(f"1,{k},{9 * k},5,8,9,1,{k},1" for k in (1, 2, 3))
    source = mot_folder(tmp_path / "s", rows, ini="name=walk\nframeRate=5\n", pictures=pictures)
    assert (yolo(source, tmp_path / "a").kept, yolo(source, tmp_path / "b", person_class="2,3").kept) == (1, 2)


@pytest.mark.parametrize("images", ["jpg", "mp4"])
def test_splits_of_a_dataset(tmp_path: Path, images: str) -> None:
    for seed in (10_000, 1):
        live = replace(make_pictured(seed, ("left",)), name=f"s{seed}")
        folder = tmp_path / "data" / f"s{seed}"
        sequence_folder.write_sequence(
            folder, live, scenario="schema = 1\n", seed=seed, streams=("left",), images=images
        )
    yolo(tmp_path / "data", tmp_path / "out")
    lines = (tmp_path / "out/data.yaml").read_text().splitlines()
    assert lines[1:3] == ["train: images/train", "val: images/val"]
    names = {kind: sorted(p.stem for p in (tmp_path / "out" / kind / "val").iterdir()) for kind in ("images", "labels")}
    assert names["images"] == names["labels"] == [f"s10000-{k:06d}" for k in range(1, 13)]
    picture = cv2.imread(str(tmp_path / "out/images/val/s10000-000004.jpg"))
    right = next(f.image for f in make_pictured(10_000, ("left",)) if f.index == 4)
    assert np.abs(picture.astype(int) - right).mean() < 15, "that of frame 4"


def test_what_has_no_pictures_is_refused(tmp_path: Path) -> None:
    sequence_folder.write_sequence(tmp_path / "s", make_sequence(1), scenario="schema = 1\n", seed=1)
    with pytest.raises(InputError, match="no pictures; expected pictures and labelled boxes"):
        yolo(tmp_path / "s", tmp_path / "out")
    assert not (tmp_path / "out").exists()
