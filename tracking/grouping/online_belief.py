"""The belief that each pair of tracked people belongs together (tracking/grouping), kept up to date by frames (ours).

The evidence of a pair is averaged over its past, in steps of at most 0.4 s, as `tracking.grouping.pair_evidence` does
for a whole sequence.
"""

from __future__ import annotations

import numpy as np

from sim.truth.merge_split_rules import close_pairs
from sim.types import Array, Bools, Ints
from tracking.grouping.belief import DECISIONS, NOW, UNSEEN, default_belief
from tracking.grouping.mate_share import MateShare
from tracking.grouping.pair_evidence import REACH, PairMeans, pair_moment
from tracking.grouping.person_motion import PersonMotion, frames_per_step

PAIR = 2**31  # Numbers of people are below this.


class PairBelief:
    """The log-odds that each pair of K people belongs together, for one of the belief's `DECISIONS`.

    Evidence is averaged over steps of some frames. decision: "now" or "events".

    State: log_odds (K, K), of the last step, or for a new person of the person's first frame; it is UNSEEN for pairs
    4 m or more apart, and if one of the two was not seen in the last step. total (K, 3), sums of x, y, m, and of time,
    s, over the frames of the current step in which a person was seen; count (K,), the number of these frames. motion,
    of the people; there (K,), who was seen in the last step. number (K,), a number of each person that is never used
    again. means, the averaged evidence of R pairs that have been near each other, and share, of mates among them; pair
    (R,), the key of each, PAIR times the one number plus the other. frames, steps: how many there were.
    """

    def __init__(self, fps: float, decision: str = NOW) -> None:
        self.column, self.others = DECISIONS.index(decision), decision != NOW
        self.fps, self.size = fps, frames_per_step(fps)
        self.seconds = self.size / fps
        self.frames = self.steps = 0
        self.log_odds, self.there = np.zeros((0, 0)), np.zeros(0, bool)
        self.total, self.count = np.zeros((0, 3)), np.zeros(0)
        self.number, self.people, self.pair = np.zeros(0, np.int64), 0, np.zeros(0, np.int64)
        self.motion, self.means = PersonMotion(0, self.seconds), PairMeans(0, self.seconds)
        self.share = MateShare(default_belief().share) if decision == NOW else None

    def add(self, state: Array) -> None:
        """Adds new people after those known so far, in the rows of `state` that exceed the number of known people.
        state (K, 4): x, y, m, vx, vy, m/s, of all people, known and new, now; nan if not seen."""
        old, n = len(self.count), len(state)
        self._reorder(np.concatenate([np.arange(old), np.full(n - old, -1)]))
        new = np.arange(n) >= old
        self.log_odds[new[:, None] | new] = UNSEEN
        i, j = self._pairs(state[:, :2])
        fresh = np.flatnonzero(new[j])
        if len(fresh):
            # new people have no past: the evidence of this moment stands for all times
            motion, means = self.motion.new(state[:, :2], state[:, 2:]), PairMeans(len(fresh), self.seconds)
            moment = pair_moment(state[:, :2], motion, i, j, others=self.others).rows(fresh)
            values = means.add(np.zeros(len(fresh), np.int64), np.arange(len(fresh)), moment)
            log_odds = default_belief().log_odds(values, moment.noise_level)[:, self.column]
            self._judge(i[fresh], j[fresh], log_odds + (0.0 if self.share is None else self.share.shift[0]))

    def keep(self, rows: Bools) -> None:
        """Removes all people except those where `rows` (K,) is True."""
        self._reorder(np.flatnonzero(rows))

    def see(self, pos: Array) -> None:
        """Adds the next frame; pos (K, 2): positions of all people, m, nan for people who are not seen."""
        seen = np.isfinite(pos[:, 0])
        self.total[seen] += np.column_stack([pos[seen], np.full(int(seen.sum()), self.frames / self.fps)])
        self.count += seen
        if self.frames % self.size == 0:
            self._end_step()
        self.frames += 1

    def seen(self) -> Bools:
        """Returns which people were seen in the last complete step, (K,) bool; all False if there is none yet."""
        return self.there

    def _end_step(self) -> None:
        n, self.there = len(self.count), self.count > 0
        seen = np.flatnonzero(self.there)
        now = self.total[seen] / self.count[seen, None]
        self.total, self.count = np.zeros((n, 3)), np.zeros(n)
        pos = now[:, :2]
        motion = self.motion.add(np.full(len(seen), self.steps), seen, pos, now[:, 2])
        self.log_odds[:] = UNSEEN
        i, j = close_pairs(np.zeros(len(seen), np.int64), pos, REACH)
        if len(i):
            moment, step = pair_moment(pos, motion, i, j, others=self.others), np.full(len(i), self.steps)
            i, j = seen[i], seen[j]
            pair = self._rows(i, j)
            log_odds = default_belief().log_odds(self.means.add(step, pair, moment), moment.noise_level)[:, self.column]
            self._judge(i, j, log_odds if self.share is None else log_odds + self.share.add(step, pair, log_odds))
        self.steps += 1

    def _judge(self, i: Ints, j: Ints, log_odds: Array) -> None:
        """Sets the log-odds (R,) of the pairs i, j (R,)."""
        self.log_odds[i, j] = self.log_odds[j, i] = log_odds

    def _pairs(self, pos: Array) -> tuple[Ints, Ints]:
        seen = np.flatnonzero(np.isfinite(pos[:, 0]))
        i, j = close_pairs(np.zeros(len(seen), np.int64), pos[seen], REACH)
        return seen[np.minimum(i, j)], seen[np.maximum(i, j)]

    def _reorder(self, old: Ints) -> None:
        """Makes the people those of the rows `old` (K',), -1 for a new one."""
        n, new = len(self.count), old < 0

        def rows(table: Array, fill: float) -> Array:
            return np.concatenate([table, np.full((1, *table.shape[1:]), fill)])[old]

        def square(table: Array, fill: float) -> Array:
            padded = np.full((n + 1, n + 1), fill)
            padded[:n, :n] = table
            return padded[np.ix_(old, old)]

        self.log_odds = square(self.log_odds, 0.0)
        self.total, self.count = rows(self.total, 0.0), rows(self.count, 0.0)
        self.there = np.append(self.there, False)[old]
        self.motion.take(old)
        count = int(new.sum())
        number = np.append(self.number, self.people)[old]
        number[new] = self.people + np.arange(count)
        self.number, self.people = number, self.people + count
        there = np.isin(self.pair // PAIR, number) & np.isin(self.pair % PAIR, number)
        if not there.all():
            self.pair = self.pair[there]
            self._take_pairs(np.flatnonzero(there))

    def _rows(self, i: Ints, j: Ints) -> Ints:
        """Returns the rows (R,) of the pairs i < j in `means`; adds those that are not there."""
        pair = self.number[i] * PAIR + self.number[j]
        every = np.union1d(self.pair, pair)
        if len(every) > len(self.pair):
            rows = np.full(len(every), -1)
            rows[np.searchsorted(every, self.pair)] = np.arange(len(self.pair))
            self.pair = every
            self._take_pairs(rows)
        return np.searchsorted(self.pair, pair)

    def _take_pairs(self, rows: Ints) -> None:
        self.means.take(rows)
        if self.share is not None:
            self.share.take(rows)
