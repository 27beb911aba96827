"""G-MITRE and the groups right up to a tolerance, on cases worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tests.hand_made import Scene, tracks, truth
from tracking.scoring import evaluate

SIX = {k: (3.0 * k, 0.0) for k in range(1, 7)}
Sets = tuple[tuple[int, ...], ...]


def near(*values: float):
    return pytest.approx(values, abs=1e-12)


def scene(*sets: tuple[int, ...], people=SIX) -> Scene:
    return Scene(people, {k: (members, None) for k, members in enumerate(sets, 1)})


def found(true: list[Scene], est: list[Scene], name: str, **options) -> tuple[float, float, float]:
    """Precision, recall, F1."""
    got = evaluate(truth(true), tracks(est, **options))
    return got[f"{name}_precision"], got[f"{name}_recall"], got[f"{name}_F1"]


GMITRE = [
    # Links: of n people together n - 1, of a person alone 1. All six people are tracked.
    pytest.param(((1, 2, 3), (4, 5)), ((1, 2, 3), (4, 5)), 4, 4, 4, id="perfect: 2 + 1, and 6 alone"),
    pytest.param((), (), 6, 6, 6, id="all are alone, and are reported so"),
    pytest.param(((1, 2, 3), (4, 5)), (), 1, 6, 4, id="nothing reported: of six alone one is right"),
    pytest.param((), ((1, 2, 3, 4, 5, 6),), 0, 5, 6, id="one giant of people who are alone"),
    pytest.param(((1, 2), (3, 4)), ((1, 2, 3, 4),), 4, 5, 4, id="merged: 2 of 3 links, and 5, 6 alone"),
    pytest.param(((1, 2, 3, 4),), ((1, 2), (3, 4)), 4, 4, 5, id="split: the same, seen from the other side"),
    pytest.param(((1, 2),), ((1, 2, 3),), 4, 5, 5, id="a person alone attached: 1 of 2, and 4, 5, 6"),
    pytest.param(((1, 2, 3),), ((1, 2),), 4, 5, 5, id="a member left alone"),
    pytest.param(((1, 2), (3, 4), (5, 6)), ((2, 3), (4, 5)), 0, 4, 3, id="a chain across the groups"),
    pytest.param(((1, 2), (3, 4), (5, 6)), ((1, 2, 3, 4, 5, 6),), 3, 5, 3, id="all chained into one"),
    pytest.param(((1, 2, 3), (4, 5, 6)), ((1, 2, 4), (3, 5, 6)), 2, 4, 4, id="two people exchanged"),
]


@pytest.mark.parametrize(("true", "est", "right", "of_est", "of_true"), GMITRE)
def test_gmitre_of_one_frame(true: Sets, est: Sets, right: int, of_est: int, of_true: int) -> None:
    expected = near(right / of_est, right / of_true, 2 * right / (of_est + of_true))
    assert found([scene(*true)], [scene(*est)], "GMITRE") == expected


def test_a_member_who_is_nobody() -> None:
    """A false track in the group of 1 and 2: of its two links one is right; 3 to 6 are alone on both sides."""
    ghost = scene((1, 2, 9), people={**SIX, 9: (3.0, 90.0)})
    assert found([scene((1, 2))], [ghost], "GMITRE") == near(5 / 6, 5 / 5, 10 / 11)


def test_hulls_without_members() -> None:
    """The people inside are the members; of two hulls round one group only one is right. Who is alone is not said."""
    true = [scene((1, 2))]
    round_them = (2.5, -0.5, 6.5, 0.5)
    hulls = [Scene({}, {1: ((), round_them), 2: ((), round_them)})]
    assert found(true, hulls, "exact_groups", unit="group") == near(1 / 2, 1, 2 / 3)
    assert np.isnan(found(true, hulls, "GMITRE", unit="group")).all()
    assert np.isnan(found(true, [Scene({})], "GMITRE", unit="group")).all()
