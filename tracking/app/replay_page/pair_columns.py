"""Why two people are taken as together, for the replay page: the evidence of each pair, and questions about pairs.

Each column is one byte per pair and step, in base64, as steps of its unit from a lowest value; 255 is unknown. A page
holds the pairs that are together with the greatest probability at any time, up to `MOST_ROWS`.
"""

from __future__ import annotations

import base64
from dataclasses import asdict

import numpy as np

from scenarios.errors import InputError
from sim.types import Array, Sequence
from tracking.app.replay_page.page_rows import Json
from tracking.fitting.questions import choose_questions
from tracking.grouping.belief import KIND, Belief, default_belief
from tracking.grouping.explained_pairs import VALUES, ExplainedPairs, quantity_of
from tracking.running.explained_people import explained_people
from tracking.running.run import TrackingRun

MOST_ROWS = 40_000  # Rows of pairs on a page: 1 MB.
UNKNOWN = 255
# Lowest value and step of a byte: of probabilities, of log-odds, of the noise of positions, m, and of `VALUES` in their
# order (m, m/s, rad, share, number of ends, standard deviations).
PROBABILITY = (0.0, 0.005)
TERM = (-12.0, 0.1)
NOISE = (0.0, 0.01)
RANGES = (
    (0.0, 0.02), (0.0, 0.02), (0.0, 0.02), (0.0, 0.02), (-5.0, 0.05), (0.0, 0.02), (0.0, 0.01), (0.0, 0.01),
    (0.0, 0.02), (0.0, 0.05), (0.0, 0.05),
)  # fmt: skip


def pair_columns(sequence: Sequence, run: TrackingRun | None, belief: Belief | None = None) -> Json | None:
    """Returns the evidence about the people of a run, or the labelled ones if it is None, and questions about them.

    belief: whose evidence; None: the default. None is returned if there are no people with ids in metres.
    """
    used = belief or default_belief()
    try:
        pairs = explained_people(sequence, run, used)
    except InputError:
        return None
    kept = shown_pairs(pairs)
    rows = np.flatnonzero(kept[pairs.pair])
    shown = pairs.take(rows)
    new = np.flatnonzero(np.append(True, (np.diff(shown.pair) != 0) | (np.diff(shown.step) != 1))[: len(rows)])
    count = np.diff(np.append(new, len(rows)))
    stints = np.column_stack([shown.a[new], shown.b[new], shown.step[new], count])
    columns = {quantity_of(name): in_bytes(shown.values[:, k], *RANGES[k]) for k, name in enumerate(VALUES)}
    note = _note(run, used)
    return {
        "size": pairs.size,
        "note": note,
        "held": None if run is None or note else [used.hold, used.join],
        "left_out": int((~kept).sum()),
        "stints": stints.tolist(),
        "probability": in_bytes(shown.probability, *PROBABILITY),
        "threshold": in_bytes(shown.threshold, *PROBABILITY),
        "bias": in_bytes(shown.bias, *TERM),
        "noise": in_bytes(shown.noise, *NOISE),
        "values": columns,
        "ranges": {quantity_of(name): RANGES[k] for k, name in enumerate(VALUES)},
        "terms": {name: in_bytes(shown.terms[:, q], *TERM) for q, name in enumerate(pairs.quantities)},
        "term_range": TERM,
        "probability_range": PROBABILITY,
        "noise_range": NOISE,
        "people": pairs.people,
        "questions": [asdict(question) for question in choose_questions(pairs)],
    }


def shown_pairs(pairs: ExplainedPairs, most: int = MOST_ROWS) -> np.ndarray:
    """Returns for each pair whether its rows are on the page: those with the greatest probabilities at any time, as
    long as there are at most `most` rows."""
    count = np.bincount(pairs.pair)
    highest = np.full(len(count), -np.inf)
    np.maximum.at(highest, pairs.pair, pairs.log_odds)
    order = np.argsort(-highest, kind="stable")
    kept = np.zeros(len(count), bool)
    kept[order] = np.cumsum(count[order]) <= most
    return kept


def in_bytes(column: np.ndarray | Array, low: float, step: float) -> str:
    """Returns a column (R,) as one byte each, in base64: steps of `step` from `low`, at most 254; nan is 255."""
    whole = np.rint((np.asarray(column, float) - low) / step).clip(0, UNKNOWN - 1)
    return base64.b64encode(np.where(np.isfinite(whole), whole, UNKNOWN).astype(np.uint8).tobytes()).decode()


def _note(run: TrackingRun | None, belief: Belief) -> str:
    """Returns what a reader must know about the belief beside the groups of a run; "" if it made them."""
    made = None if run is None else run.info.get("grouping")
    if run is None or (made is not None and made.get("hash") == belief.as_dict()["hash"]):
        return ""
    if made is None and not run.info:
        return "What made the groups is not stated. This is what the belief says."
    if made is None:
        return "The tracker names its groups itself. This is what the belief says."
    if made.get("grouping") == KIND:
        return "Another belief made the groups. Name its file with --grouping to see its evidence."
    return "The baseline rule made the groups. This is what the belief says."
