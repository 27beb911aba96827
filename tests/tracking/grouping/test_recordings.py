"""The baseline rule on real people, from true positions. Figures and what they mean: benchmarks/grouping.py."""

import numpy as np
import pytest

from sim.io.source import open_source
from sim.types import Tracks
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.link_rule import LinkRule


def as_tracks(truth):
    found = []
    for index in range(1, truth.length + 1):
        here = truth.at(index)
        n = len(here.id)
        pos = here.box[:, :2] + here.box[:, 2:] / 2 if here.pos is None else here.pos
        vel = np.full((n, 2), np.nan) if here.vel is None else here.vel
        plane, alone = "image" if here.pos is None else "ground", np.full(n, -1)
        found.append(
            Tracks(index, here.t, plane, "person", here.id, alone, pos, vel, np.zeros((n, 4, 4)), here.box, np.ones(n))
        )
    return found


def test_pets_persons_11_and_12_are_a_group(shared_data):
    truth = open_source(shared_data / "mot" / "PETS09-S2L1-first200")[0].truth
    made = derive(as_tracks(truth), truth.fps, truth.px_per_m)
    both = [t.group[np.isin(t.id, (11, 12))] for t in made if {11, 12} <= set(t.id.tolist())]
    one = [bool(a == b and a >= 0) for a, b in both]
    assert len(one) == 125
    assert one.index(True) <= 7, "1 s until they are acquainted"
    assert all(one[7:]), "and never apart"


@pytest.mark.parametrize(
    ("rule", "low", "high"),
    [
        (LinkRule(), 0.63, 0.70),  # takes those who wait at a stop for groups
        (LinkRule(near=1.0, idle=0.4), 0.86, 0.91),  # chosen on simulated crowds
    ],
)
def test_seq_hotel(shared_data, rule, low, high):
    """Pairwise F1 over all frames. Each frame alone, with the best of nine settings for this recording: 0.789."""
    truth = open_source(shared_data / "biwi" / "seq_hotel")[0].truth
    hit = said = true = 0
    for index, t in enumerate(derive(as_tracks(truth), truth.fps, rule=rule), 1):
        i, j = np.triu_indices(len(t.id), 1)
        label = truth.group[truth.rows(index)]
        same, linked = ((g[i] >= 0) & (g[i] == g[j]) for g in (label, t.group))
        hit, said, true = hit + (same & linked).sum(), said + linked.sum(), true + same.sum()
    assert true == 919
    assert low < 2 * hit / (said + true) < high
