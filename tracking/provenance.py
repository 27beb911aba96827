"""What run.json says of a run: who tracked what, given what, and how fast."""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sim.types import Sequence, Tracks

if TYPE_CHECKING:
    from tracking.run import Prepared

SAID = 6  # settings of a sensor that are said in words: of a whole profile the rest is in run.json


@dataclass(frozen=True)
class Speed:
    """Frames per second: of the tracker alone, and with reading and decoding what it is given."""

    tracker: float = 0.0
    whole: float = 0.0


def describe(
    ready: Prepared,
    answers: SequenceOf[Tracks],
    seed: int,
    sensor: Mapping[str, Any],
    px_per_m: float,
    speed: Speed,
) -> dict[str, Any]:
    """What run.json holds; px_per_m: by which groups were derived. Only the speeds differ between two equal runs."""
    from sim.io.store.box_source import box_source

    sample = ready.context.background
    begins = 1 if sample is None else causal_from(ready.sequence)
    return {
        "tracker": ready.name,
        "config": ready.config.as_dict() if ready.config else {},
        "seed": seed,
        "sequence": ready.sequence.name,
        "detections": ready.mode,
        "sensor": dict(sensor),
        "plane": answers[0].plane if len(answers) else None,
        "boxes": box_source(answers, ready.context.camera),
        "fps": ready.context.fps,
        "px_per_m": None if np.isnan(px_per_m) else px_per_m,
        "background": None if sample is None else ready.sequence.source.get("background", f"{len(sample)} frames"),
        "causal": begins is not None,
        "causal_from": begins,
        "frames": len(answers),
        "frames_per_second": speed.tracker,
        "whole_frames_per_second": speed.whole,
        "versions": _versions(),
    }


def causal_from(sequence: Sequence) -> int | None:
    """The first frame from which answers owe the background to no later frame, None where all do.

    What was learned from the first N frames has seen ahead for whoever answers one of those before N.
    """
    from sim.io.store.background_sample import Sample

    sample = sequence.load_background
    if not isinstance(sample, Sample):
        return 1
    return sample.choice.count if sample.choice.how == "first" else None


def given(info: Mapping[str, Any]) -> str:
    """What a tracker was given, in words, by its run.json; "" where that does not say."""
    mode, background, sensor = (info.get(key) for key in ("detections", "background", "sensor"))
    more = [f"background: {background}"] if background else []
    more += [f"{key} = {value}" for key, value in list((sensor or {}).items())[:SAID]]
    more += [f"{len(sensor) - SAID} more"] if sensor and len(sensor) > SAID else []
    return f"{mode} ({', '.join(more)})" if more else str(mode or "")


def _versions() -> dict[str, str]:
    from importlib.metadata import PackageNotFoundError, version

    found = {}
    for name in ("flockscope", "numpy", "scipy"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
