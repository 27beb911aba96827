"""score_arrays: a user's own columns give what files and types of ours give; README's lines run as they stand."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Truth
from tracking import track
from tracking.scoring import evaluate, score_arrays
from tracking.scoring.people import IncomparableError

ROWS = {"frame": [1, 1, 2, 2], "id": [1, 2, 1, 2], "pos": [[0, 0], [1, 0], [0, 0], [1, 0]], "group": [7, 7, 7, 7]}


def columns(true: Truth, *names: str) -> dict[str, np.ndarray]:
    return {name: getattr(true, name) for name in ("frame", "id", *names)}


@pytest.fixture(scope="module")
def merge() -> Truth:
    true = simulate(load("merge"), 5).truth
    assert true is not None
    return true


@pytest.mark.parametrize("names", [("pos", "group"), ("box", "group"), ("pos", "box", "group")])
def test_truth_as_tracks_is_perfect(merge: Truth, names: tuple[str, ...]) -> None:
    true = columns(merge, *names)
    found = score_arrays(true, true, fps=merge.fps)
    assert found.surface == ("ground" if "pos" in names else "image")
    groups = ("group_F1", "pairwise_F1", "exact_groups_F1", "event_F1", "lineage_accuracy")
    for key in ("objective", "HOTA", "IDF1", *groups):
        assert found[key] == pytest.approx(1, abs=1e-12), key


def test_the_same_as_with_our_types(merge: Truth) -> None:
    run = track("blob", simulate(load("merge"), 5, streams=()))
    est = {
        "frame": np.concatenate([np.full(len(t.id), t.index) for t in run]),
        **{name: np.concatenate([getattr(t, name) for t in run]) for name in ("id", "pos", "box", "group")},
    }
    was, now = evaluate(merge, run), score_arrays(columns(merge, "pos", "box", "group"), est, fps=merge.fps)
    same = ("group", "pairwise", "GMITRE", "right", "exact", "HOTA", "IDF1", "MOTA", "RMSE_pos", "GOSPA")
    for key, value in was.items():
        if key.startswith(same) and "core" not in key:
            assert now[key] == pytest.approx(value, abs=1e-9, nan_ok=True), key


def test_groups_that_are_not_given_are_derived_or_unknown(merge: Truth) -> None:
    true, bare = columns(merge, "pos", "group"), columns(merge, "pos")
    derived = score_arrays(true, bare, fps=merge.fps)
    assert 0.5 < derived["pairwise_F1"] < 1  # by the baseline rule, which is late
    unknown = score_arrays(bare, true, fps=merge.fps)
    assert unknown["HOTA"] == 1
    assert np.isnan(unknown["pairwise_F1"])
    nobody = score_arrays(true, true | {"group": np.full_like(merge.group, -1)}, fps=merge.fps)
    assert nobody["pairwise_F1"] == 0  # it says that all are alone
    alone = score_arrays(true | {"group": np.full_like(merge.group, -1)}, true, fps=merge.fps)
    assert alone["pairwise_precision"] == 0  # so does the truth: it is not to be derived


def test_empty_sides_are_no_error() -> None:
    none = {"frame": [], "id": [], "pos": [], "group": []}
    assert score_arrays(ROWS, none, fps=10)["FN"] == 4
    assert score_arrays(none, ROWS, fps=10)["FP"] == 4
    assert score_arrays(none, none, fps=10)["FP"] == 0


def test_the_warning_of_misread_arrays_names_nothing_of_files() -> None:
    with pytest.warns(UserWarning, match=r"read as x_cm,y_cm, 100% would: give frames, order and units of the columns"):
        score_arrays(ROWS | {"pos": np.full((4, 2), 5)}, ROWS | {"pos": np.full((4, 2), 500)}, fps=10)


WRONG_COLUMNS = [
    ({"grp": [1, 1, 1, 1]}, "'grp'"), ({"pos": None}, "frame, id, and pos or box"),
    ({"pos": [0, 1, 0, 1]}, r"pos of shape \(4,\)"), ({"id": [1, 2, 1]}, "3 rows of id"),
    ({"frame": [0, 0, 1, 1]}, "got 0 in frame, expected whole numbers from 1 to 1,000,000"),
    ({"frame": [1, 1, 2, 10**7]}, "got 10000000.* in frame, expected whole numbers from 1 to"),
    ({"frame": [1, 1, 2, 1e300]}, "1e.300 in frame"),
    ({"id": [1, -2, 1, 2]}, "-2 in id, expected whole numbers from 0"), ({"group": [7, -2, 7, 7]}, "-2 in group"),
    ({"id": ["a", "b", "a", "b"]}, "'a' in id, expected whole numbers from 0"),
    ({"id": [None, 1, 2, 3]}, "None"), ({"pos": [["x", "y"]] * 4}, "'x' in pos, expected numbers"),
    ({"pos": [[0, 0], [1e200, 0], [0, 0], [1, 0]]}, "1e.200 in pos, expected numbers from -1e.06 to 1,000,000"),
    ({"pos": None, "box": [[0, 0, 1, 0]] * 4}, "got 0 in box, .* width and height above 0"),
    ({"frame": np.ones(5001), "id": np.arange(5001), "pos": np.zeros((5001, 2)), "group": None}, "5001 rows"),
    ({"id": [1, 2.5, 1, 2]}, "2.5 in id"), ({"pos": [[0, 0], [np.nan, 0], [0, 0], [1, 0]]}, "nan in pos"),
    ({"frame": [1, 1, 1, 1]}, "id 1 is twice in frame 1"),
    ({"pos": None, "box": [[0, 0, 1, 1]] * 4}, "one of them on both"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "said"), WRONG_COLUMNS)
def test_wrong_columns(change: dict, said: str) -> None:
    wrong = {name: values for name, values in (ROWS | change).items() if values is not None}
    with pytest.raises(ValueError, match=said):
        score_arrays(ROWS, wrong, fps=10)


@pytest.mark.parametrize("fps", [0, 1e9, -5.0, float("nan"), "25"])
def test_wrong_frame_rate(fps: float) -> None:
    with pytest.raises(ValueError, match=f"fps: got {fps!r}, expected a number from 0.01 to 1000"):
        score_arrays(ROWS, ROWS, fps=fps)


@pytest.mark.parametrize("scale", [0.0, -20.0, float("nan"), float("inf")])
def test_positions_in_the_image_are_not_compared_without_a_scale(scale: float) -> None:
    table = {"frame": [1, 2], "id": [1, 1], "box": [[0, 0, 10, 20], [1, 0, 10, 20]]}
    with pytest.raises(IncomparableError, match="no image scale"):
        score_arrays(table, table, fps=10.0, similarity="image", px_per_m=scale)
    nobody = {"frame": [], "id": [], "box": []}
    assert score_arrays(table, nobody, fps=10.0, similarity="image", px_per_m=scale)["MOTA"] == 0.0
    assert score_arrays(table, table, fps=10.0, px_per_m=scale)["HOTA"] == 1.0
