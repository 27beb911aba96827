"""The benchmarks of the papers' tables: what they print where data are missing, units, and signs of differences."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.group_pda import scenes
from benchmarks.joint import runs, table2
from tests import hand_made
from tests.processes import python

ROW = {
    "MSE": 25.0,
    **{f"group_{key}": 1.0 for key in ("TP", "FN", "FP", "IDSW", "GDSR", "MOTP", "MOTA", "1-FN", "1-FP")},
}


def given(data: Path) -> argparse.Namespace:
    return argparse.Namespace(seeds=range(1), filter_seeds=range(1), set=[], data=data)


def test_table_2_is_made_without_recordings(tmp_path, monkeypatch, capsys):
    """What is missing is said before anything is measured; exit code 1, as Table 3b has failed."""

    def scored(made, variants, _given):
        assert "biwi/seq_hotel is not in" in (said := capsys.readouterr().err)
        assert f"{tmp_path}; give its folder by --data" in said
        return {v.name: [ROW] for v in variants}

    monkeypatch.setattr(table2, "sequences", lambda seeds: [])
    monkeypatch.setattr(table2, "_scored", scored)
    with pytest.raises(SystemExit) as end:
        table2.table2(given(tmp_path))
    assert end.value.code == 1
    printed = capsys.readouterr().out
    assert "Table 2: " in printed
    assert "| 25.0 (0.0) |" in printed
    assert "Table 3b" not in printed


def test_missing_recordings_are_one_line(tmp_path):
    done = python("-m", "benchmarks", "relational", "recordings", "--data", tmp_path)
    assert done.returncode == 2
    assert re.fullmatch(rf"{tmp_path}/biwi/seq_hotel: got nothing there; .*\n", done.stderr)


def test_errors_are_mean_squares_in_px(monkeypatch):
    """Tracks 3 px and 4 px from the truth have 25 px²."""
    shift = np.array([3.0, 4.0]) / runs.PX_PER_M
    walk = [hand_made.Scene({1: (0.1 * k, 0.0), 2: (0.1 * k, 5.0)}) for k in range(10)]
    off = [hand_made.Scene({i: tuple(np.add(p, shift)) for i, p in here.people.items()}) for here in walk]
    monkeypatch.setattr(runs, "track", lambda *a, **b: hand_made.tracks(off))
    (row,) = runs.measured(SimpleNamespace(truth=hand_made.truth(walk)), runs.Variant(""), range(1))
    assert row["MSE"] == pytest.approx(25.0)


def test_differences_are_first_minus_second():
    better, worse = (dict.fromkeys(scenes.DECIDED, value) | {"pairs": 1, "kept": value} for value in (1.0, 0.25))
    assert scenes.differences([better] * 6, [worse] * 6) == ["+0.750 [+0.750, +0.750] *"] * len(scenes.DECIDED)
