"""`flockscope track`: warnings before the first frame."""

from __future__ import annotations

import pytest

from tests.recordings import biwi_walk
from tracking.app.cli import run


@pytest.mark.parametrize(("tracker", "count"), [("stereo", 1), ("group-pda", 0)])
def test_stereo_from_points_is_warned_of(tracker, count, tmp_path, capsys):
    """The tracker that the warning names gives none."""
    source = biwi_walk(tmp_path / "walk") / "obsmat.txt"
    assert run(["track", tracker, str(source), "--out", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().err.count("made for stereo pairs; on points, group-pda") == count
