"""Whether a sequence shows real motion: recordings, and replays of them. Nothing is ever tuned on these."""

from __future__ import annotations

from sim.types import Sequence

SIMULATED = ("simulated", "generated", "replayed")


def is_real(sequence: Sequence) -> bool:
    """True for a recording and for a replay of one; a sequence that does not say what it is, is no recording."""
    kind, origin = sequence.source.get("kind"), sequence.source.get("origin")
    return bool(origin["real"]) if origin is not None else kind is not None and kind not in SIMULATED
