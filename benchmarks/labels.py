"""What answers about pairs gain at a place: pairwise F1 on the other pairs, before and after.

    python -m benchmarks.labels recordings [--draws 20] [--data FOLDER]
    python -m benchmarks.labels priors [--scenes streets standard] [--seeds 10000:10001]

recordings: seq_hotel and zara01, answered as their labels have it. In each draw the questions come from 80 % of the
pairs, drawn at random; the pairs asked about are left out of both scores. Means and 2.5 to 97.5 % of the draws, also
with one answer in ten wrong, and for pairs drawn at random in place of chosen ones.
priors: the same on simulated scenes with at least 80 pairs, once each, for other spreads of the prior of `adapt` and
without any (nothing is adapted); means over scenes with 95 % intervals, and the worst scene. `SPREAD` was chosen by
this table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from benchmarks.belief.pairs import linked_pairs, pairs_in_frames
from benchmarks.support.options import HOTEL, ZARA, add_data, add_seeds, new_parser
from benchmarks.support.replaced_code import replaced_code
from benchmarks.support.tables import difference_cell, head, interval, mean_cell, number, row, signed
from scenarios.loading.resolve import resolve
from sim.types import Array, Bools, Ints, Truth
from tracking.fitting import place_belief, questions
from tracking.fitting.grouping_scenes import simulated
from tracking.fitting.place_belief import Answered, adapt
from tracking.fitting.questions import COUNT, Question, choose_questions, shown_stretches
from tracking.grouping.belief import Belief, default_belief
from tracking.grouping.explained_pairs import ExplainedPairs, explain
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.tracks_table import tabulate
from tracking.recordings.source import open_source

ALLOWED = 0.8  # Share of the pairs from which the questions of a draw come.
WRONG = 0.1  # Share of wrong answers.
LEAST_PAIRS = 80
SPREADS = ((1e-6, 1e-6, 1e-6), (0.5, 0.15, 0.15), (1.0, 0.2, 0.2), (1.0, 0.3, 0.3), (1.0, 0.5, 0.5), (2.0, 0.5, 0.5))


@dataclass(frozen=True, eq=False)
class Place:
    """A labelled sequence, with the evidence about its pairs."""

    truth: Truth

    @cached_property
    def pairs(self) -> ExplainedPairs:
        """The evidence, by the default belief."""
        truth = self.truth
        table = tabulate(people_as_tracks(truth), truth.fps, truth.px_per_m)
        return explain(table, truth.fps, default_belief())

    @cached_property
    def together(self) -> Bools:
        """Whether the two of each row of evidence are labelled as one group, (R,)."""
        truth, pairs = self.truth, self.pairs
        size = int(truth.id.max()) + 1
        key = truth.frame * size + truth.id
        order = np.argsort(key)
        frame = pairs.step * pairs.size + 1
        a, b = (truth.group[order[np.searchsorted(key[order], frame * size + id)]] for id in (pairs.a, pairs.b))
        return np.asarray((a >= 0) & (a == b))

    @cached_property
    def labelled(self) -> tuple[Ints, Ints, Bools]:
        """Rows i, j of pairs of people of one frame, and whether they are labelled as one group."""
        return pairs_in_frames(self.truth)

    @cached_property
    def before(self) -> Bools:
        """Which of these pairs the default belief puts together."""
        return linked_pairs(self.truth, default_belief(), *self.labelled[:2])

    def answers(self, asked: Sequence[Question], wrong: Bools) -> Answered:
        """Returns the answers that the labels give, those of `wrong` (questions,) the other way round."""
        rows = [self.rows(q) for q in asked]
        question = np.repeat(np.arange(len(rows)), [len(r) for r in rows])
        said = np.array([self.together[r].mean() > 0.5 for r in rows]) != wrong
        return Answered(np.concatenate(rows), question, said[question])

    def rows(self, q: Question) -> Ints:
        """Returns the rows of evidence of a question."""
        pairs, frame = self.pairs, self.pairs.step * self.pairs.size + 1
        return np.flatnonzero((pairs.a == q.a) & (pairs.b == q.b) & (frame >= q.first) & (frame <= q.last))

    def scores(self, asked: Sequence[Question], belief: Belief) -> tuple[float, float]:
        """Returns the pairwise F1 before and after, of the pairs that were not asked about."""
        i, j, true = self.labelled
        low, high = np.sort([self.truth.id[i], self.truth.id[j]], axis=0)
        size = int(self.truth.id.max()) + 1
        kept = ~np.isin(low * size + high, [q.a * size + q.b for q in asked])
        found = (self.before, linked_pairs(self.truth, belief, i, j))
        before, after = (2 * (x & true & kept).sum() / max(((x & kept).sum() + (true & kept).sum()), 1) for x in found)
        return float(before), float(after)


Choose = Callable[[ExplainedPairs, np.random.Generator], list[Question]]


def chosen(pairs: ExplainedPairs, rng: np.random.Generator, count: int = COUNT) -> list[Question]:
    """Returns the questions of `choose_questions`, from a part of the pairs that is drawn."""
    return choose_questions(pairs, count, rng.random(int(pairs.pair[-1]) + 1) < ALLOWED)


def drawn(pairs: ExplainedPairs, rng: np.random.Generator) -> list[Question]:
    """Returns questions about pairs that are drawn at random."""
    found = shown_stretches(pairs)
    picks = rng.permutation(len(found.begin))[:COUNT]
    return [questions.question_of(pairs, int(found.begin[k]), int(found.end[k])) for k in picks]


def draw(place: Place, choose: Choose, wrong: float, seed: int) -> tuple[float, float]:
    """Returns the pairwise F1 before and after of one draw. wrong: probability of a wrong answer."""
    rng = np.random.default_rng(seed)
    asked = choose(place.pairs, rng)
    answers = place.answers(asked, rng.random(len(asked)) < wrong)
    return place.scores(asked, adapt([(place.pairs, answers)]).belief)


def recordings(data: Path, draws: int) -> None:
    ways: dict[str, tuple[Choose, float]] = {
        f"{COUNT // 2} chosen pairs": (lambda pairs, rng: chosen(pairs, rng, COUNT // 2), 0.0),
        f"{COUNT} chosen pairs": (chosen, 0.0),
        f"{COUNT} chosen, one answer in ten wrong": (chosen, WRONG),
        f"{COUNT} pairs at random": (drawn, 0.0),
        f"{COUNT} at random, one answer in ten wrong": (drawn, WRONG),
    }
    head(["recording", "answers", "before", "after", "gain", "worst draw"])
    for folder in (HOTEL, ZARA):
        truth = open_source(data / folder, images=False)[0].truth
        assert truth is not None
        place = Place(truth)
        for words, (choose, wrong) in ways.items():
            found = np.array([draw(place, choose, wrong, seed) for seed in range(draws)])
            gain = found[:, 1] - found[:, 0]
            cells = [interval(*_spread(x)) for x in found.T]
            row([Path(folder).name, words, *cells, signed(*_spread(gain)).removesuffix(" *"), f"{gain.min():+.3f}"])


def _spread(values: Array) -> tuple[float, float, float]:
    low, high = np.quantile(values, [0.025, 0.975])
    return float(values.mean()), float(low), float(high)


def priors(names: Sequence[str], seeds: range) -> None:
    places = [Place(simulated(entry, seed)) for name in names for entry in resolve(name) for seed in seeds]
    places = [place for place in places if len(place.pairs.pair) and place.pairs.pair[-1] + 1 >= LEAST_PAIRS]
    print(f"\n{', '.join(names)}, seeds {seeds.start}:{seeds.stop}, {len(places)} scenes")
    head(["prior: bias, place, motion", "before", "after", "gain", "worst", "gain, one in ten wrong", "worst"])
    for spread in SPREADS:
        cells = list[str]()
        for wrong in (0.0, WRONG):
            with _prior(spread):
                found = np.array([draw(place, chosen, wrong, k) for k, place in enumerate(places)])
            gain = found[:, 1] - found[:, 0]
            cells += [mean_cell(x) for x in found.T if not wrong]
            cells += [difference_cell(gain), number(float(gain.min()))]
        row([", ".join(f"{x:.1f}" for x in spread), *cells])


@contextmanager
def _prior(spread: Sequence[float]) -> Iterator[None]:
    precision = np.diag(np.array(spread) ** -2.0)
    values = {"SPREAD": np.array(spread), "PRECISION": precision}
    changes = [(place_belief, name, value) for name, value in values.items()]
    with replaced_code([*changes, (questions, "PRECISION", precision)]):
        yield


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("what", choices=["recordings", "priors"])
    parser.add_argument("--draws", type=int, default=20, metavar="N", help="of recordings: number of draws")
    parser.add_argument("--scenes", nargs="+", default=["streets", "standard"], metavar="NAME")
    add_seeds(parser, "10000:10001")
    add_data(parser)
    options = parser.parse_args()
    if options.what == "recordings":
        recordings(options.data, options.draws)
    else:
        priors(options.scenes, options.seeds)


if __name__ == "__main__":
    main()
