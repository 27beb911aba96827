"""MOTS: masks in the text and in the pictures of ids are the stream ids; hidden people are one ignored region."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.store import sequence_folder
from tests.made_up import SIZE, make_in_view
from tracking.export.labelled_pictures import labelled_pictures
from tracking.export.mots import compressed, mots


def lengths(text: str) -> list[int]:
    """The inverse of `compressed`, as COCO's maskApi.c has it."""
    found, place = list[int](), 0
    while place < len(text):
        number, k, more = 0, 0, True
        while more:
            code = ord(text[place]) - 48
            number |= (code & 0x1F) << 5 * k
            more, place, k = bool(code & 0x20), place + 1, k + 1
            if not more and code & 0x10:
                number |= -1 << 5 * k
        found.append(number + (found[-2] if len(found) > 2 else 0))
    return found


@pytest.mark.parametrize(
    ("counts", "text"),
    [([6, 1, 40, 4, 5, 4, 5, 4, 21], "61X13mN000`0"), ([0, 1000, 3, 5, 1992], "0Xo03mPOUn1"), ([], "")],
)
def test_compressed_is_what_pycocotools_writes(counts: list[int], text: str) -> None:
    assert compressed(counts) == text


def test_any_lengths_come_back() -> None:
    r = np.random.default_rng(0)
    for size in (1, 2, 3, 4, 50):
        counts = (r.integers(0, 2, size) * r.integers(0, 10**6, size)).tolist()
        assert lengths(compressed(counts)) == counts


def stored(folder: Path, streams: tuple[str, ...]) -> Path:
    live = make_in_view(1, streams)
    return sequence_folder.write_sequence(folder, live, scenario="schema = 1\n", seed=1, streams=streams, images="png")


def test_masks_are_the_visible_pixels(tmp_path: Path) -> None:
    (labelled,) = labelled_pictures(stored(tmp_path / "s", ("left", "ids")))
    made = mots(tmp_path / "s", tmp_path / "out")
    name = labelled.sequence.name
    folder = tmp_path / "out/MOTS-train" / name
    assert (tmp_path / "out/seqmaps/MOTS-train.txt").read_text() == f"name\n{name}\n"
    assert "seqLength=12\nimWidth=64\nimHeight=48\nimExt=.png\n" in (folder / "seqinfo.ini").read_text()
    rows = [line.split(" ") for line in (folder / "gt/gt.txt").read_text().splitlines()]
    kept = ignored = regions = 0
    for index in range(1, 13):
        people, expected = labelled.people(index), np.zeros(SIZE[::-1], int)
        for person, hidden in zip(people.id.tolist(), people.ignored.tolist(), strict=True):
            expected[people.ids == person] = 10_000 if hidden else 2000 + person
        codes = cv2.imread(str(folder / f"instances/{index:06d}.png"), cv2.IMREAD_UNCHANGED)
        assert codes.dtype == np.uint16
        assert np.array_equal(codes, expected)
        masks = {int(row[1]): row for row in rows if row[0] == str(index)}
        assert masks.keys() == set(np.unique(expected).tolist()) - {0}
        for code, row in masks.items():
            assert row[2:5] == ["10" if code == 10_000 else "2", "48", "64"]
            runs = lengths(row[5])
            flat = np.repeat(np.arange(len(runs)) % 2, runs).astype(bool)
            assert np.array_equal(flat.reshape(SIZE).T, expected == code)
        assert (folder / f"img1/{index:06d}.png").read_bytes() == (tmp_path / f"s/img1/{index:06d}.png").read_bytes()
        kept, ignored = kept + int((~people.ignored).sum()), ignored + int(people.ignored.sum())
        regions += 10_000 in masks
    assert (made.pictures, made.kept, made.ignored) == (12, kept, ignored)
    assert min(kept, regions) > 0


def test_ids_are_needed(tmp_path: Path) -> None:
    stored(tmp_path / "s", ("left",))
    with pytest.raises(InputError, match="no stream ids; expected the streams left and ids; generate with --streams"):
        mots(tmp_path / "s", tmp_path / "out")
