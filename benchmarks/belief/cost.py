"""Mode `cost` of `benchmarks.belief`: CPU time of the belief.

People of the scene crowd-dense, copied beside each other; copies begin at different times. A pair-step is one pair of
people within 4 m of each other in one step of 0.4 s.
First table: CPU µs for each pair-step, of probabilities (`pair_probabilities`) and of groups and their events
(`derive`), best of --rounds. Second table: the live belief (`PairBelief`) at 10 frames/s, CPU ms for each frame and the
share of real time.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial

import numpy as np

from benchmarks.belief.errors import of_rows
from benchmarks.support.tables import head, row
from benchmarks.support.timing import best_times, machine_load
from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from sim.types import Array, Truth
from tracking.grouping.belief import Belief
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.online_belief import PairBelief
from tracking.grouping.pair_beliefs import pair_probabilities
from tracking.grouping.tracks_table import tabulate

SCENE, SEED = "crowd-dense", 20_000
EVERY = 4  # frames at 10 frames/s in a step of 0.4 s
BESIDE = 10.0  # m between copies
LATER = 7  # frames by which each copy begins later


def crowd(people: int) -> Truth:
    """Returns a truth with about so many people in view at 10 frames/s: positions, velocities and groups."""
    (entry,) = (entry for entry in resolve("standard") if entry.name == SCENE)
    one = simulate(entry.scenario, SEED, streams=()).truth
    assert one.pos is not None
    mean = len(one.id) / one.length
    size = int(one.id.max()) + 1
    apart = float(np.ptp(one.pos, axis=0).max()) + BESIDE
    side = int(np.ceil(np.sqrt(people / mean)))
    copies = [_first(one, people)] if people < mean else []
    for k in range(0 if copies else round(people / mean)):
        place = apart * np.array(divmod(k, side))
        frame = (one.frame - 1 + LATER * k) % one.length + 1
        # people begin anew where a copy starts again
        id = one.id + size * (2 * k + (one.frame - 1 + LATER * k >= one.length))
        group = np.where(one.group >= 0, one.group + size * k, -1)
        copies.append(one.replace(frame=frame, id=id, group=group, pos=one.pos + place))
    return _joined(one, copies)


def _first(truth: Truth, people: int) -> Truth:
    """Returns the truth of its first people, so many that `people` are in view on average."""
    ids, count = np.unique(truth.id, return_counts=True)
    enough = int(np.searchsorted(np.cumsum(count), people * truth.length)) + 1
    return of_rows(truth, np.isin(truth.id, ids[:enough]))


def _joined(one: Truth, copies: Sequence[Truth]) -> Truth:
    names = ("frame", "id", "group", "pos", "vel", "visibility")
    rows = {name: np.concatenate([getattr(copy, name) for copy in copies]) for name in names}
    order = np.lexsort((rows["id"], rows["frame"]))
    none = dict.fromkeys(("box", "visible_box", "truncation", "z", "heading", "height", "subgroup"))
    return one.replace(**{name: values[order] for name, values in rows.items()}, **none, groups=None, events=None)


def cost(people: Sequence[int], rounds: int, belief: Belief) -> None:
    """Prints the tables."""
    crowds = [crowd(count) for count in people]
    print(machine_load())
    head(["people in view", "pair-steps", "probabilities, µs", "groups and events, µs"])
    for truth in crowds:
        slow = each_step(truth)
        tracks = people_as_tracks(slow)
        table = tabulate(tracks, slow.fps, 1.0)
        pairs = len(pair_probabilities(table, slow.fps, belief).frame)
        works = (
            partial(pair_probabilities, table, slow.fps, belief),
            partial(derive, tracks, slow.fps, 1.0, belief, objective=True),
        )
        spent = [best_times(work, rounds)[0] for work in works]
        row([_in_view(truth), str(pairs), *(f"{1e6 * seconds / pairs:.2f}" for seconds in spent)])
    head(["people in view", "live, ms/frame", "slowest frame, ms", "share of real time"])
    for truth in crowds:
        spent_live = np.min([live(truth) for _ in range(rounds)], axis=0)
        share = spent_live.mean() * truth.fps
        row([_in_view(truth), f"{1e3 * spent_live.mean():.2f}", f"{1e3 * spent_live.max():.1f}", f"{share:.1%}"])


def each_step(truth: Truth) -> Truth:
    """Returns the truth of one frame of each step."""
    kept = of_rows(truth, (truth.frame - 1) % EVERY == 0)
    frame, length = (kept.frame - 1) // EVERY + 1, -(-truth.length // EVERY)
    return kept.replace(frame=frame, fps=truth.fps / EVERY, length=length)


def _in_view(truth: Truth) -> str:
    return f"{len(truth.id) / truth.length:.0f}"


def live(truth: Truth) -> Array:
    """Returns the CPU seconds of each frame of the live belief about people who come and go, (T,)."""
    assert truth.pos is not None
    assert truth.vel is not None
    pairs, known, spent = PairBelief(truth.fps), np.zeros(0, np.int64), []
    for index in range(1, truth.length + 1):
        rows = truth.rows(index)
        id, state = truth.id[rows], np.column_stack([truth.pos[rows], truth.vel[rows]])
        begun = time.process_time()
        pairs.keep(np.isin(known, id))
        known = known[np.isin(known, id)]
        known = np.concatenate([known, id[~np.isin(id, known)]])
        state = state[np.searchsorted(id, known)]
        pairs.add(state)
        pairs.see(state[:, :2])
        spent.append(time.process_time() - begun)
    return np.array(spent)
