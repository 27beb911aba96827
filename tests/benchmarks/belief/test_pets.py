"""The couples of PETS09."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.belief import pets
from scenarios.errors import InputError
from tests import hand_made
from tracking.grouping.known_people import people_as_tracks
from tracking.scoring.evaluation import evaluate


def people(ids):
    place = {id: (50.0 * k, 100.0) for k, id in enumerate(ids)}
    truth = hand_made.truth([hand_made.Scene(place)] * 40)
    box = np.column_stack([truth.pos, np.tile([20.0, 60.0], (len(truth.id), 1))])
    return truth.replace(box=box, events=None)


def test_the_couples_are_the_groups():
    truth = pets.with_couples(people([9, 11, 12, 13, 15]))
    grouped = {k: truth.id[truth.rows(k)][truth.group[truth.rows(k)] >= 0].tolist() for k in (1, 22, 24)}
    assert grouped == {1: [], 22: [11, 12], 24: [9, 11, 12, 15]}
    members = {k: sorted(m.tolist() for m in truth.groups_px[k - 1].members) for k in (1, 22, 24)}
    assert members == {1: [], 22: [[11, 12]], 24: [[9, 15], [11, 12]]}
    tracks = [
        t.replace(group=truth.group[truth.rows(t.index)], groups=truth.groups_px[t.index - 1], derived=True)
        for t in people_as_tracks(truth)
    ]
    found = evaluate(truth, tracks, similarity="boxes")
    assert found["pairwise_precision"] == found["pairwise_recall"] == 1.0


def test_another_recording_is_refused():
    with pytest.raises(InputError, match="no person 15 in frames 24 to 200"):
        pets.with_couples(people([9, 11, 12]))
