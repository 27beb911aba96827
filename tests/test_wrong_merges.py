"""Each reported merge of a hand-made truth lands in its row of benchmarks.wrong_merges."""

from __future__ import annotations

import numpy as np

from benchmarks.wrong_merges import findings
from sim.types import GroupEvent, Truth

FPS, LENGTH, PEOPLE = 10.0, 200, 8


def merge(start: int, *members: int) -> GroupEvent:
    return GroupEvent("merge", start, start, None, (1, 2), (1,), members, None)


def truth_of(events: tuple[GroupEvent, ...]) -> Truth:
    """Persons 1 and 2 are one group for all the time, 3 and 4 from frame 51 to 80, 5 and 6 from 51 on, 7 walks alone
    past 8, who stands; 1 to 6 walk."""
    frame, id = (a.ravel() for a in np.meshgrid(np.arange(1, LENGTH + 1), np.arange(1, PEOPLE + 1), indexing="ij"))
    group = np.full(len(frame), -1)
    group[id <= 2] = 1
    group[np.isin(id, (3, 4)) & (frame >= 51) & (frame <= 80)] = 2
    group[np.isin(id, (5, 6)) & (frame >= 51)] = 3
    vel = np.where((id == 8)[:, None], 0.0, [[1.0, 0.0]])
    return Truth(
        name="hand-made", fps=FPS, length=LENGTH, px_per_m=40.0, frame=frame, id=id, group=group, vel=vel,
        pos=vel * frame[:, None], box=None, visibility=np.ones(len(frame)), events=events,
    )  # fmt: skip


def test_each_merge_has_its_row() -> None:
    truth = truth_of((merge(51, 3, 4), merge(51, 5, 6)))
    reports = [
        (merge(61, 5, 6), 70),  # right: 1 s late
        (merge(62, 3, 4), 70),  # 1.1 s late
        (merge(5, 1, 2), 9),
        (merge(5, 6, 7), 9),
        (merge(5, 8, 8), 9),
    ]
    found = findings(truth, reports)
    assert [f.kind for f in found] == [
        "right", "at another time", "who belong together", "strangers who walk", "strangers who stand",
        "missed, together for up to 4 s",
    ]  # fmt: skip
    assert (found[0].start, found[0].reported, found[0].people) == (6.1, 7.0, (5, 6))


def test_a_report_answers_one_true_merge_only() -> None:
    truth = truth_of((merge(51, 5, 6),))
    found = findings(truth, [(merge(51, 5, 6), 60), (merge(52, 5, 6), 61)])
    assert [f.kind for f in found] == ["right", "at another time"]
    assert [f.kind for f in findings(truth, [])] == ["missed, together for longer"]
