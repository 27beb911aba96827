"""Which seeds are for what: training, validation, test, fitting, demonstration."""

from __future__ import annotations

from scenarios.errors import InputError

SPLITS = (("train", 0, 10_000), ("val", 10_000, 20_000), ("test", 20_000, 30_000), ("fit", 30_000, 40_000))
DEMO = ("demo", 40_000, 2**63)


def split_of(seeds: range) -> str:
    """train, val, test, fit or demo; InputError for a range that crosses two or holds nothing."""
    if len(seeds) == 0 or min(seeds) < 0:
        raise InputError(
            place="seeds", got=f"{seeds.start}:{seeds.stop}", expected="a:b with 0 <= a < b", remedy="correct --seeds"
        )
    for name, low, high in (*SPLITS, DEMO):
        if low <= min(seeds) < high:
            if max(seeds) < high:
                return name
            raise InputError(
                place="seeds", got=f"{seeds.start}:{seeds.stop}", expected=f"a range inside {low}:{high} ({name})",
                remedy=f"end the range at {high} or begin it there",
            )  # fmt: skip
    raise AssertionError("every seed has a split")
