import math
import tracemalloc

import numpy as np
import pytest

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import GroupEvent, Groups, Tracks
from tests.reference_sense import paced
from tracking.grouping.grouped_tracks import derive, events_at_end, with_groups
from tracking.grouping.link_rule import LinkRule
from tracking.recordings.labelled_truth import labelled_truth_fields
from tracking.running.run import TrackingRun, group, track

FPS = 10.0
# Whose times follow from the paths by hand.
RULE = LinkRule()


def tracks(people, *, scale=1.0, there=None, boxes=False, group=None, vel=True, ids=None):
    """One Tracks per frame from paths; there (T, P), group (T, P) as a tracker gave it, ids (P,)."""
    pos, speed = (np.stack([p[k] for p in people], axis=1) * scale for k in (0, 1))
    there = np.ones(pos.shape[:2], bool) if there is None else there
    ids = np.arange(1, len(people) + 1) if ids is None else np.array(ids)
    out = []
    for t in range(len(pos)):
        k = np.flatnonzero(there[t])
        n = len(k)
        box = np.column_stack([pos[t, k] - [5, 10], np.tile([10.0, 20], (n, 1))]) if boxes else None
        label = np.full(n, -1) if group is None else group[t, k]
        moves = speed[t, k] if vel else np.full((n, 2), np.nan)
        known = ids[k], label, pos[t, k], moves, np.zeros((n, 4, 4)), box, np.ones(n)
        out.append(Tracks(t + 1, t / FPS, "image" if scale != 1 else "ground", "person", *known))
    return out


def passing():
    """Two pairs that walk through each other."""
    return [paced((12, (v, 0)), start=(x, 5 + y)) for x, v in ((0, 1), (10, -1)) for y in (0, 0.7)]


def events(made):
    return [(t.index, e.kind, e.start, e.before, e.after, e.members) for t in made for e in t.events]


def side_by_side(seconds=20.0, n=2):
    return [paced((seconds, (1, 0)), start=(0, 0.7 * k)) for k in range(n)]


def joining(speed=0.4, near=0.8):
    """A pair, and one who drifts towards it: 6 - 0.4 t < 1.5 from frame 114 on."""
    seconds = round((6 - near) / speed, 1)
    return [*side_by_side(), paced((seconds, (1, -speed)), (20 - seconds, (1, 0)), start=(0, 6.7))]


def leaving():
    """A pair, and one 0.69 m beside it who drifts away at 0.4 m/s from 5 s on."""
    return [*side_by_side(), paced((5, (1, 0)), (15, (1, 0.4)), start=(0, 1.39))]


def truth(made):
    id, pos, vel = (np.concatenate([getattr(t, name) for t in made]) for name in ("id", "pos", "vel"))
    return labelled_truth_fields(np.arange(1, len(id) + 1), id, id // 2, pos, vel, fps=FPS, length=len(made))


@pytest.mark.parametrize("measure", [truth, lambda made: derive(made, FPS, rule=RULE), lambda made: derive(made, FPS)])
def test_memory_grows_as_what_was_seen(measure):
    """Of people who come one after the other, tables of all frames by all people would grow as their square."""

    def peak(people):
        still, there = np.zeros((20 * people, 2)), np.repeat(np.eye(people, dtype=bool), 20, axis=0)
        made = tracks([(still, still)] * people, there=there)
        tracemalloc.start()
        measure(made)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    peak(2)  # imports
    assert peak(160) < 6 * peak(40)


def test_a_pair_is_a_group_once_it_is_acquainted():
    made = derive(tracks(side_by_side()), FPS, rule=RULE)
    assert [t.group.tolist() for t in made[:9]] == [[-1, -1]] * 9
    assert all(t.group.tolist() == [1, 1] for t in made[9:])
    assert all(len(t.groups.id) == (t.index > 9) for t in made)
    assert events(made) == [], "who was there when it began neither formed nor entered"
    assert made[50].groups.members[0].tolist() == [1, 2]
    high = [t.replace(plane="space", pos=np.pad(t.pos, ((0, 0), (0, 1)))) for t in tracks(side_by_side())]
    assert {t.groups.pos.shape[1] for t in derive(high, FPS, rule=RULE)} == {2}, "as of frames without groups"


def test_merge_is_told_when_known_and_dated_back():
    """Near from frame 114 on: 16 of the last 20 frames from frame 129 on."""
    made = derive(tracks(joining()), FPS, rule=RULE)
    assert events(made) == [(129, "merge", 114, (-1, 1), (1,), (1, 2, 3))]
    event = made[128].events[0]
    assert (event.emitted, event.end) == (129, 129)
    assert made[127].group.tolist() == [1, 1, -1]
    assert made[128].group.tolist() == [1, 1, 1]


def test_split_after_two_seconds_apart():
    """0.69 + 0.4 (t - 5) > 2.5 from t > 9.525 s: first in frame 97, for 2 s in frame 116."""
    made = derive(tracks(leaving()), FPS, rule=RULE)
    assert events(made) == [(116, "split", 97, (1,), (-1, 1), (1, 2, 3))]


@pytest.mark.parametrize(("apart", "told"), [(1.8, []), (2.8, ["merge"])])
def test_who_was_never_apart_does_not_merge(apart, told):
    near = paced((8, (1, 0)), (4, (1, (0.8 - apart) / 4)), (8, (1, 0)), start=(0, 0.7 + apart))
    made = derive(tracks([*side_by_side(), near]), FPS, rule=RULE)
    assert [e[1] for e in events(made)] == told
    assert made[-1].group.tolist() == [1, 1, 1], "the groups know it all the same"


@pytest.mark.parametrize(("gap", "together", "hidden"), [(0.7, 0, 0), (0.7, 2, 0), (1.7, 8, 0), (0.7, 2, 9)])
def test_who_was_together_by_mistake_parts_without_an_event(gap, together, hidden):
    """Two who part at 0.7 m/s, at once, or after some time side by side, one at times hidden for 0.9 s."""
    parting = [paced((16, (1, 0))), paced((together, (1, 0)), (16 - together, (1, 0.7)), start=(0, gap))]
    made = derive(tracks(parting, there=np.arange(160)[:, None] % 20 >= [0, hidden]), FPS)
    assert max(len(set(t.group.tolist())) < len(t.group) for t in made[:30])
    assert [e[1] for e in events(made)] == ["dissolve"] * (together > 0)


def test_the_ends_of_a_chain_part_when_its_middle_leaves():
    """Under the rule no link breaks then: A is linked to B and B to C."""
    chain = [paced((12, (1, 0)), start=(0, y)) for y in (0, 2.8, 1.4)]
    there = np.ones((len(chain[0][0]), 3), bool)
    there[60:, 2] = False
    assert [e[1] for e in events(derive(tracks(chain, there=there), FPS, rule=LinkRule()))] == ["dissolve"]


def naming(own):
    """A pair whose tracker names its groups, own (T, 2), from the first frame on, where there is none yet."""
    return [t.replace(groups=Groups.none() if (t.group < 0).all() else None) for t in tracks(side_by_side(), group=own)]


def test_what_a_tracker_says_is_kept():
    own = np.full((200, 2), -1)
    own[30:] = 7
    made = derive(naming(own), FPS)
    assert [t.group.tolist() for t in made[28:32]] == [[-1, -1], [-1, -1], [7, 7], [7, 7]]
    assert events(made) == [(31, "form", 31, (-1, -1), (7,), (1, 2))]
    assert made[40].groups.id.tolist() == [7]
    told = GroupEvent("merge", 5, 5, 6, (-1, -1), (7,), (1, 2), (0.0, 0.0))
    given = [t.replace(groups=Groups.none(), events=(told,) if t.index == 6 else ()) for t in tracks(side_by_side())]
    made = derive(given, FPS)
    assert all(t.groups is g.groups for t, g in zip(made, given, strict=True))
    assert [t.events for t in made] == [t.events for t in given]


def test_crossings_and_queues_of_tracks():
    """The hulls come within 1 m in frame 44 and part after frame 58; 20 frames later it is known."""
    found = events(derive(tracks(passing()), FPS))
    assert [(i, kind, start, members) for i, kind, start, _, _, members in found] == [(78, "cross", 44, (1, 2, 3, 4))]
    still = [paced((5, (-1, 0)), (7, (0, 0)), start=(5 + 0.8 * k, 0)) for k in range(3)]
    (row,) = [e for e in events(derive(tracks(still), FPS)) if e[1] == "queue"]
    assert row[2] == 51
    assert row[0] == 120, "it lasts to the end, and is not known before"
    gone = [paced((5, (-1, 0)), (7, (0, 0)), (8, (0, 1)), start=(5 + 0.8 * k, 0)) for k in range(3)]
    (row,) = [e for e in derive(tracks(gone), FPS) for e in e.events if e.kind == "queue"]
    assert row.emitted == row.end + 30 + 15, "3 s until leaving is told from advancing, 1.5 s for a line that is lost"


@pytest.mark.parametrize(("length", "at_end"), [(77, 1), (78, 0), (79, 0), (110, 0)])
def test_events_that_the_end_of_a_recording_makes_known_are_counted(length, at_end):
    """The crossing ends in frame 58 and is known in frame 78."""
    given = tracks(passing())[:length]
    made = derive(given, FPS)
    assert [e.kind for t in made for e in t.events] == ["cross"]
    assert events_at_end(given, made, FPS) == at_end
    assert events_at_end(made, made, FPS) == 0, "the tracker's own do not count"
    still = tracks([paced((5, (-1, 0)), (7, (0, 0)), start=(5 + 0.8 * k, 0)) for k in range(3)])
    assert events_at_end(still, derive(still, FPS), FPS) == 1, "a queue that lasts"
    assert events_at_end([], [], FPS) == 0


def test_events_of_the_last_frame_are_in_order_of_time_after_the_trackers_own():
    """A crossing that is known in the last frame, and a queue from the first frame on that is reported as it ends."""
    still = [paced((12, (0, 0)), start=(60 + 0.8 * k, 0)) for k in range(3)]
    given = tracks([*passing(), *still])[:78]
    told = GroupEvent("merge", 78, 78, 78, (-1, -1), (7,), (1, 2), (0.0, 0.0))
    for own in ((), (told,)):
        made = derive([*given[:77], given[77].replace(events=own)], FPS)
        assert [e.kind for e in made[-1].events] == ["merge"] * len(own) + ["queue", "cross"]


def test_who_joins_as_they_come_is_no_merge():
    there = np.ones((200, 3), bool)
    there[:60, 2] = False
    made = derive(tracks(side_by_side(n=3), there=there), FPS, rule=RULE)
    assert events(made) == []
    assert made[100].group.tolist() == [1, 1, 1]
    there[:60] = False
    made = derive(tracks(side_by_side(n=3), there=there), FPS, rule=RULE)
    assert events(made) == [(70, "enter", 61, (), (1,), (1, 2, 3))]


def test_a_group_waits_for_a_member_who_is_not_seen():
    there = np.ones((200, 2), bool)
    there[50:58, 1] = there[140:, 1] = False
    given = tracks(side_by_side(), there=there)
    made = derive([t.replace(seen=(t.id == 1) | (t.index <= 120)) for t in given], FPS)
    assert made[49].group.tolist() == made[58].group.tolist() == [1, 1]
    assert made[52].group.tolist() == [-1], "a group of which one is seen is none now"
    assert events(made) == [(151, "leave", 120, (1,), (-1,), (1, 2))], "measured last in frame 120"


RULES = [
    (joining(), LinkRule(near=1.0), 142),  # 6 - 0.4 t < 1 from frame 127 on
    (joining(), LinkRule(share=1.0), 133), (joining(), LinkRule(window=1.0), 121),
    (joining(), LinkRule(alike=0.3), 146),  # not before it stops drifting, in frame 131
    (leaving(), LinkRule(apart=2.0), 103), (leaving(), LinkRule(patience=1.0), 106),
]  # fmt: skip


@pytest.mark.parametrize(("people", "changed", "told"), RULES)
def test_parameters_of_the_rule(people, changed, told):
    assert [e[0] for e in events(derive(tracks(people), FPS, rule=changed))] == [told]


def test_named_groups_without_events_get_them():
    """As `with_groups` has it for runs and scores: the groups are the tracker's, what happens to them is derived."""
    pairs = np.tile([3, 3, 8, 8], (120, 1))
    named = [t.replace(events=(), derived=False) for t in derive(tracks(passing(), group=pairs), FPS)]
    assert all(t.groups is not None for t in named)
    made = with_groups(named, FPS, math.nan)
    assert events(made) == [(78, "cross", 44, (3, 8), (3, 8), (1, 2, 3, 4))]
    assert all(t.groups is g.groups for t, g in zip(made, named, strict=True))
    own = np.full((200, 2), -1)
    own[30:] = 7
    named = [t.replace(events=(), derived=False) for t in derive(naming(own), FPS)]
    assert events(with_groups(named, FPS, 1.0)) == [(31, "form", 31, (-1, -1), (7,), (1, 2))]


def test_a_kind_that_is_told_is_not_derived_but_the_others_are():
    named = derive(tracks(passing()), FPS)
    merge = GroupEvent("merge", 5, 5, 6, (-1, -1), (7,), (1, 2), (0.0, 0.0))
    cross = GroupEvent("cross", 5, 5, 6, (1, 2), (1, 2), (1, 2, 3, 4), (0.0, 0.0))
    queue = GroupEvent("queue", 5, 5, 6, (), (), (1, 2, 3), (0.0, 0.0))
    for told, kinds in ((merge, ["merge", "cross"]), (cross, ["cross"]), (queue, ["queue", "cross"])):
        given = [t.replace(events=(told,) if t.index == 6 else (), derived=False) for t in named]
        assert [e[1] for e in events(with_groups(given, FPS, 1.0))] == kinds


def test_groups_of_a_run_are_found_anew_also_where_the_tracker_reported_events_itself() -> None:
    """The same run without groups and events of its own has the same groups and events."""
    sequence = simulate(load("merge"), 0)
    own = [t.replace(own_events=("merge", "split"), events=()) for t in track("blob", sequence, detections="truth")]
    bare = [t.replace(group=np.full(len(t.id), -1), groups=None, own_events=(), derived=False) for t in own]
    found, expected = (group(sequence, TrackingRun(tuple(run), {"input": "boxes"})) for run in (own, bare))
    assert repr([t.events for t in found]) == repr([t.events for t in expected])
    assert {"merge"} <= {e.kind for t in found for e in t.events}
