"""Who is in a picture, who is ignored, which files are pictures, and where an export may be written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.store import sequence_folder
from tests.made_up import make_in_view
from tracking.export.labelled_pictures import in_turn, labelled_pictures, new_export


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    live = make_in_view(1, ("left", "ids"))
    return sequence_folder.write_sequence(
        tmp_path / "s", live, scenario="schema = 1\n", seed=1, streams=("left", "ids"), images="png"
    )


def test_people_without_a_pixel_are_ignored(stored: Path) -> None:
    """The pixels of the fake show persons 1 and 2 only."""
    (labelled,) = labelled_pictures(stored, 0.2)
    truth, seen = labelled.truth, 0
    for index in range(1, truth.length + 1):
        people = labelled.people(index)
        assert np.array_equal(people.id, truth.id[people.rows])
        assert np.array_equal(people.ignored, (truth.visibility[people.rows] < 0.2) | (people.id > 2))
        seen += int((~people.ignored).sum())
    assert seen > 0
    (everybody,) = labelled_pictures(stored, 0)
    assert not any(everybody.people(k).ignored.any() for k in range(1, truth.length + 1))


def test_parts_of_boxes_lie_in_the_picture(stored: Path) -> None:
    (labelled,) = labelled_pictures(stored)
    parts = np.concatenate([labelled.people(k).part for k in range(1, 13)])
    assert len(parts)
    assert (parts[:, :2] < parts[:, 2:]).all()
    assert (parts >= 0).all()
    assert (parts <= (64, 48, 64, 48)).all()


def test_a_truth_is_freed_after_its_turn(stored: Path) -> None:
    labelled = labelled_pictures(stored)
    for each in in_turn(labelled):
        assert each.truth.length == 12
    assert "_truth" not in labelled[0].sequence.__dict__


@pytest.mark.parametrize("share", [-0.1, 1.1, float("nan")])
def test_a_share_lies_between_0_and_1(stored: Path, share: float) -> None:
    with pytest.raises(InputError, match=r"--min-visibility: got .*a share from 0 to 1"):
        labelled_pictures(stored, share)


def test_pictures_are_the_stored_bytes_and_checked(stored: Path) -> None:
    (labelled,) = labelled_pictures(stored, pictured=True)
    assert [(k, kind) for k, _, kind in labelled.pictures()] == [(k, "png") for k in range(1, 13)]
    assert [body for _, body, _ in labelled.pictures()] == [path.read_bytes() for path in labelled.files().values()]
    (stored / "img1/000003.png").write_bytes(b"other")
    with pytest.raises(InputError, match=r"000003\.png"):
        list(labelled.pictures())


def test_a_new_export_is_whole_or_absent(tmp_path: Path, stored: Path) -> None:
    with pytest.raises(ZeroDivisionError), new_export(tmp_path / "out"):
        _ = 1 / 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["s"]
    (tmp_path / "out").mkdir()
    (tmp_path / "out/.DS_Store").touch()
    for name in "ab":
        with new_export(tmp_path / "out") as partial:
            (partial / name).touch()
        assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [name, "export.json"], "the former is replaced"
    (tmp_path / "out/mine").touch()
    for place, words in (("out", "got mine, a file that"), ("out/b", "got b, a file that"), ("s/deep/er", "of a seq")):
        with pytest.raises(InputError, match=words), new_export(tmp_path / place):
            pass
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["b", "export.json", "mine"]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"files": 5}', '{"files": [["a"], 5]}'])
def test_a_list_of_another_program_lists_nothing(tmp_path: Path, text: str) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out/export.json").write_text(text)
    with pytest.raises(InputError, match=r"got export\.json, a file that"), new_export(tmp_path / "out"):
        pass
    assert (tmp_path / "out/export.json").read_text() == text
