"""Names of sequences are labels: whatever a label holds, its path stays inside the folder of --out."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from scenarios.errors import InputError
from sim.io.files.atomic import PARTIAL
from sim.io.files.own_files import file_name, output_path, output_paths

EVIL = (
    "../../x", "/etc/passwd", "..", ".", "", "a\0b", "a/b", "a\\b", "C:x", "con", "NUL.txt", "\u202egnp.exe", "x" * 300,
    "ä" * 200, ".partial-x", ".hidden", "a.", "a ", "\udcff", "a\nb", "~", "-rf", "${HOME}",
)  # fmt: skip
ENDINGS = ("", ".html", ".view.mp4", "-s00001")
labels = st.one_of(st.text(max_size=300), st.text("./\\\0 aé\n:", max_size=20), st.sampled_from(EVIL))


def check(folder: Path, label: str, ending: str) -> None:
    path = output_path(folder, label, ending)
    assert path.parent == folder
    assert path.name not in ("", ".", "..")
    assert not path.name.startswith(".")
    assert os.path.realpath(path) == os.path.join(os.path.realpath(folder), path.name)
    temporary = f"{PARTIAL}{path.name}-{'0' * 12}"
    assert len(os.fsencode(temporary)) <= 255
    temporary.encode("utf-8")


@given(labels, st.sampled_from(ENDINGS))
@example("../../x", "")
def test_no_label_leaves_the_folder(label: str, ending: str) -> None:
    check(Path("/some/folder"), label, ending)


@pytest.mark.parametrize("label", EVIL)
def test_every_such_file_can_be_made(tmp_path: Path, label: str) -> None:
    path = output_path(tmp_path, label, ".html")
    path.write_text("x")
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("label", ["merge-s00003", "seq_hotel", "Über 1 (b)", "a.b", "A-1", "PETS09-S2L1", "日本"])
def test_harmless_labels_are_file_names(label: str) -> None:
    assert file_name(label) == label


@given(st.lists(labels, max_size=5))
def test_no_two_labels_share_a_path(names: list[str]) -> None:
    try:
        paths = output_paths(Path("out"), names, ".png")
    except InputError:
        return
    assert len({str(path).casefold() for path in paths}) == len(names)


@pytest.mark.parametrize(("a", "b"), [("x", "x"), ("a/b", "a_b"), ("A", "a"), ("é", "e\u0301"), ("", "_")])
def test_two_labels_of_one_file_are_refused(a: str, b: str) -> None:
    with pytest.raises(InputError, match="unique names"):
        output_paths(Path("out"), [a, b])


def test_long_labels_with_one_beginning_stay_apart() -> None:
    assert file_name("x" * 300) != file_name("x" * 301)
