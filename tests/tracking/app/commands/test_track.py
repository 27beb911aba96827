"""`flockscope track`: warnings before the first frame, and the lines that it prints."""

from __future__ import annotations

import pytest

from tests.recordings import biwi_walk
from tracking.app.cli import run
from tracking.app.commands.track import _lines


@pytest.mark.parametrize(("tracker", "count"), [("stereo", 1), ("group-pda", 0)])
def test_stereo_from_points_is_warned_of(tracker, count, tmp_path, capsys):
    """The tracker that the warning names gives none."""
    source = biwi_walk(tmp_path / "walk") / "obsmat.txt"
    assert run(["track", tracker, str(source), "--out", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().err.count("made for stereo pairs; on points, group-pda") == count


def test_runs_with_the_same_input_are_one_line():
    one = {
        "sequence": "a", "detections": "file", "frames": 10, "tracks": 3, "groups": 2, "lasting_groups": 1,
        "frames_per_second": 100.0, "whole_frames_per_second": 50.0, "folder": "out/a",
    }  # fmt: skip
    other = {**one, "sequence": "b", "frames": 30, "frames_per_second": 300.0, "folder": "out/b"}
    assert _lines([one], "out") == [
        "a: 10 frames, 3 tracks, 2 groups (1 of 2 s or longer), detections file, "
        "100 frames/s (50 with reading) → out/a"
    ]  # fmt: skip
    words = "40 frames, 6 tracks, 4 groups (2 of 2 s or longer), detections file, 200 frames/s (50 with reading)"
    assert _lines([one, other], "out") == [f"2 sequences: {words} → out"]
    noisy = {**other, "sensor": {"noise_m": 0.1}}
    assert [line.split(":")[0] for line in _lines([one, noisy, noisy], "out")] == ["a", "2 sequences"]
