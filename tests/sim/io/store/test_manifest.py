"""A manifest with an intact seal whose values are of another kind: one line, not a TypeError later."""

import json

import pytest

from scenarios.errors import InputError
from sim.io.files.tables import json_document
from sim.io.store.seal import MANIFEST, with_hash
from sim.io.store.sequence_folder import open_sequence, write_sequence

WRONG = {
    "fps": ["10", -5, 0, None, 1e9, True], "length": ["5", -1, 2.5, 10**8, None], "px_per_m": ["x", -1, 0, 1e-3, 2e5],
    "image_size": [[1], "x", [0, 0], [64, 48, 3], ["64", 48], [16384, 16384]], "name": [5, None],
}  # fmt: skip
TOP = {
    "streams": ["left", ["x"], None, [1]], "images": [5, "gif"], "seed": ["a", -1, None, 1.5], "repeat": ["x"],
    "truth_hash": [5], "sequence": [None, 5, []],
}  # fmt: skip


def sealed(folder, change):
    manifest = json.loads((folder / MANIFEST).read_bytes())
    change(manifest)
    (folder / MANIFEST).write_bytes(json_document(with_hash(manifest)))


@pytest.mark.parametrize(
    ("place", "value"),
    [(f"sequence.{key}", v) for key, some in WRONG.items() for v in some] + [(k, v) for k, w in TOP.items() for v in w],
)
def test_values_of_another_kind(tmp_path, make_sequence, place, value):
    folder = write_sequence(tmp_path / "a", make_sequence(1), scenario="a = 1\n", seed=1)
    key = place.removeprefix("sequence.")
    sealed(folder, lambda m: (m["sequence"] if key != place else m).__setitem__(key, value))
    with pytest.raises(InputError) as error:
        open_sequence(folder)
    assert error.value.place.startswith(place)
    assert error.value.file == str(folder / MANIFEST)


def test_another_length_than_the_files(tmp_path, make_sequence):
    folder = write_sequence(tmp_path / "a", make_sequence(1), scenario="a = 1\n", seed=1)
    sealed(folder, lambda m: m["sequence"].__setitem__("length", 7))
    with pytest.raises(InputError, match="7 frames"):
        list(open_sequence(folder).frames())
    with pytest.raises(InputError, match="7 frames"):
        open_sequence(folder).truth  # noqa: B018
