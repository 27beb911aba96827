"""Texts of KITTI's tracking benchmark: people with their boxes, other types left out, wrong lines named."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.io.source import open_source

BODY = "1.7 0.6 0.8 1.0 1.6 9.0 0.2"
LINES = (
    f"0 -1 DontCare -1 -1 -10 219.3 188.5 245.5 218.6 -1000 -1000 -1000 -10 -1 -1 -1\n"
    f"0 0 Pedestrian 0 0 -0.3 100.0 150.0 130.5 230.0 {BODY}\n"
    f"1 0 Pedestrian 0 1 -0.3 103.0 150.0 133.0 230.0 {BODY}\n"
    f"1 2 Car 0 0 -0.3 296.7 161.7 455.2 292.3 {BODY}\n"
    f"2 5 Person_sitting 0 2 -0.3 10.0 150.0 40.0 210.0 {BODY} 0.8\n"
)


def opened(folder, text):
    (folder / "0012.txt").write_text(text)
    return open_source(folder / "0012.txt")[0]


def test_people_with_boxes(tmp_path):
    sequence = opened(tmp_path, LINES)
    truth = sequence.truth
    assert (sequence.fps, sequence.length, sequence.has_detections) == (10.0, 3, False)
    assert list(zip(truth.frame.tolist(), truth.id.tolist(), strict=True)) == [(1, 0), (2, 0), (3, 5)]
    np.testing.assert_allclose(truth.box[0], [100, 150, 30.5, 80])
    assert truth.pos is None


WRONG_LINES = [
    (LINES.replace("1 0 Pedestrian 0 1 -0.3 103.0", "1 0 Pedestrian 0 1 -0.3 x"), "line 3"),
    (LINES.replace("133.0", "103.0"), "line 3"),
    (LINES.replace("2 5 Person_sitting", "-1 5 Person_sitting"), "line 5: .* frames from 0"),
    (LINES.replace("133.0", "nan"), r"line 3: .* finite numbers"),
    (LINES.replace("133.0", "1e9"), r"line 3: .* numbers within"),
    (LINES.replace("2 5 Person_sitting", "2 -1 Person_sitting"), "line 5: .* ids from 0"),
    (LINES.replace("Pedestrian", "Van").replace("Person_sitting", "Tram"), "Car, DontCare, Tram, Van"),
]


@pytest.mark.parametrize(("wrong", "place"), WRONG_LINES)
def test_wrong_lines_are_named(tmp_path, wrong, place):
    with pytest.raises(InputError, match=place):
        opened(tmp_path, wrong)


def test_other_options_are_refused(tmp_path):
    (tmp_path / "0012.txt").write_text(LINES)
    with pytest.raises(InputError, match="--class"):
        open_source(tmp_path / "0012.txt", person_class=1)
