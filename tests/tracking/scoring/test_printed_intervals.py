"""No interval leaves the range of its score, and intervals of fewer than 6 sequences are called indicative."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.support.tables import difference_cell, mean_cell
from tests.recordings import mot_folder
from tests.refusals import answer
from tracking.app.cli import run
from tracking.scoring.catalogue import CATALOGUE
from tracking.tuning.candidates import Goal, compare_episodes

# Student's quantile for one degree of freedom is 12.7: the interval of these two is -0.674 to 1.384.
TWO = [0.274, 0.436]


def test_cells_of_benchmarks() -> None:
    assert mean_cell(TWO) == "0.355 [0.000, 1.000], indicative"
    assert mean_cell(TWO, "RMSE_pos") == "0.355 [0.000, 1.384], indicative"
    assert difference_cell([0.0, 0.9]) == "+0.450 [-1.000, +1.000], indicative"
    assert difference_cell([0.5, 0.5, 0.500001]) == "+0.500 [+0.500, +0.500], indicative", "never sure"
    assert difference_cell([0.5] * 5 + [0.500001]) == "+0.500 [+0.500, +0.500] *"
    assert mean_cell([0.5, np.nan]) == "0.500"


def runs(folder: Path, sequences: int) -> list[str]:
    """A dataset of one person, tracks that are right, and tracks that are right in the first sequence only."""
    rows = "".join(f"{f},1,{10 + f},10,20,40,1,1,1\n" for f in range(1, 9))
    for k in range(sequences):
        mot_folder(folder / "data" / f"S{k}", rows, ini=f"name=S{k}\nframeRate=5\n")
        for name, text in (("right", rows), ("wrong", rows if k == 0 else rows.replace(",10,20,", ",500,20,"))):
            (folder / name).mkdir(exist_ok=True)
            (folder / name / f"S{k}.txt").write_text(text)
    return [str(folder / name) for name in ("data", "right", "wrong")]


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("sequences", [2, 6])
def test_score(tmp_path: Path, capsys, sequences: int) -> None:
    data, right, wrong = runs(tmp_path, sequences)
    found = answer(capsys, "score", data, right, wrong, "--by", "HOTA")
    few = sequences < 6
    for pair in found["differences"]:
        for key, one in pair["scores"].items():
            span = CATALOGUE[key].high - CATALOGUE[key].low
            assert one["low"] is None or -span <= one["low"] <= one["high"] <= span, key
        assert pair["indicative"] is few
    for row in found["ranking"]:
        assert (0 <= row["low"] <= row["high"] <= 1, row["indicative"]) == (True, few)
    means = answer(capsys, "score", data, wrong)["mean"]
    for key, one in means.items():
        assert one["low"] is None or CATALOGUE[key].low <= one["low"] <= one["high"] <= CATALOGUE[key].high, key
    assert (means["HOTA"]["indicative"], means["group_F1"]["low"]) == (few, None)
    for words in ([data, wrong], [data, right, wrong]):
        assert run(["score", *words]) == 0
        assert ("intervals of fewer than 6 sequences are indicative" in capsys.readouterr().out) is few


def test_tune() -> None:
    def of(*values: float) -> list:
        return [SimpleNamespace(scores={"HOTA": value}) for value in values]

    goal = Goal("HOTA")
    few = compare_episodes("validation", goal, of(0.0, 0.1), of(0.0, 1.0))
    assert (few.low, few.high, few.indicative) == (-1.0, 1.0, True)
    assert few.difference_words == "+0.4500 [-1.0000, +1.0000], indicative"
    many = compare_episodes("validation", goal, of(*[0.1] * 6), of(*[0.2] * 5, 0.21))
    assert not many.indicative
    assert "indicative" not in many.difference_words
