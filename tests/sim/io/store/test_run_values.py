"""A run.json with an intact seal whose values are of another kind: one line, not a TypeError later."""

from __future__ import annotations

import json

import pytest

from scenarios.errors import InputError
from sim.io.files.tables import json_document
from sim.io.store.seal import read_run, with_hash
from sim.io.store.track_files import tracks_files, write_tracks
from tracking.app.stored_tracks import find_tracks

WRONG = {
    "tracker": [None, 5, ["blob"]], "sequence": [None, 5, {}], "config": [[], "x", 3], "grouping": ["x", [1]],
    "sensor": [[], "x"], "seed": ["0", 1.5, True], "detections": [5, ["image"]], "background": [5, {}],
    "plane": [2, []], "causal": ["yes", 1], "truth_hash": [5, []], "fps": ["10", -5, 0, 1e9, True],
    "px_per_m": ["x", True], "boxes": [None, "x", 3],
}  # fmt: skip


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in WRONG.items() for value in values])
@pytest.mark.parametrize("given", ["", "tracks.txt"])
def test_values_of_another_kind(tmp_path, make_tracks, key, value, given):
    folder = write_tracks(tmp_path / "t", make_tracks(1), fps=10.0, info={"sequence": "s"})
    run = {**json.loads((folder / "run.json").read_bytes()), key: value}
    (folder / "run.json").write_bytes(json_document(with_hash(run)))
    with pytest.raises(InputError) as error:
        find_tracks(folder / given)
    assert (error.value.file, error.value.place) == (str(folder / "run.json"), key)
    assert "track again" in error.value.remedy


@pytest.mark.parametrize(
    ("key", "value"), [(key, v) for key, values in WRONG.items() if key != "boxes" for v in values]
)
def test_what_cannot_be_read_is_not_written(make_tracks, key, value):
    with pytest.raises(InputError) as error:
        tracks_files(make_tracks(1), fps=10.0, info={key: value})
    assert (error.value.file, error.value.place) == ("run.json", key)


def test_right_values_and_further_keys(tmp_path, make_tracks):
    for info in ({}, dict.fromkeys(WRONG.keys() - {"tracker", "sequence", "boxes"}), {"mine": [1, {"a": None}]}):
        assert info.items() <= read_run(write_tracks(tmp_path / "t", make_tracks(1), fps=10.0, info=info)).items()
