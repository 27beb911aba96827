"""What may be tuned on: the splits of seeds (train, val, test, fit, demo), and never the motion of real people."""

from __future__ import annotations

from scenarios.errors import InputError
from sim.types import Sequence

# (name, first seed, seed after the last)
SPLITS = (("train", 0, 10_000), ("val", 10_000, 20_000), ("test", 20_000, 30_000), ("fit", 30_000, 40_000))

DEMO = ("demo", 40_000, 2**63)
TUNING_SPLITS = ("train", "val")  # splits on which parameters may be chosen; replays of recordings are refused there

SIMULATED = ("simulated", "generated", "replayed")  # values of `Sequence.source["kind"]` that are no recordings


def split_of(seeds: range) -> str:
    """Returns the name of the split that holds all seeds.

    Raises InputError if there is no seed, a seed is negative, or the seeds are in two splits.
    """
    if len(seeds) == 0 or min(seeds) < 0:
        got, expected = f"{seeds.start}:{seeds.stop}", "a:b with 0 <= a < b"
        raise InputError(place="seeds", got=got, expected=expected, remedy="correct --seeds")
    for name, low, high in (*SPLITS, DEMO):
        if low <= min(seeds) < high:
            if max(seeds) < high:
                return name
            got, remedy = f"{seeds.start}:{seeds.stop}", f"end the range at {high} or begin it there"
            raise InputError(place="seeds", got=got, expected=f"a range inside {low}:{high} ({name})", remedy=remedy)
    raise AssertionError("every seed has a split")


def is_real(sequence: Sequence) -> bool:
    """Returns True if the sequence shows the motion of real people: a recording, or a replay of a recording."""
    kind, origin = sequence.source.get("kind"), sequence.source.get("origin")
    return bool(origin["real"]) if origin is not None else kind is not None and kind not in SIMULATED
