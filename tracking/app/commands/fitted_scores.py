"""Seeds and lines of scores of the commands `fit …` that can check their fit on other seeds."""

from __future__ import annotations

from collections.abc import Mapping

from tracking.app import option_parsing


def fit_and_check_seeds(fitted: str, checked: str | None) -> dict[str, range]:
    """Returns the seeds of --seeds under "fitted" and, if given, those of --check under "checked"."""
    asked = {"fitted": ("--seeds", fitted), "checked": ("--check", checked)}
    return {key: option_parsing.seeds(text, option) for key, (option, text) in asked.items() if text is not None}


def score_lines(seeds: Mapping[str, range], scores: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Returns a line for each of "fitted" and "checked": its seeds and its scores by name."""
    return [
        f"{key}, seeds {numbers.start}:{numbers.stop}: "
        + ", ".join(f"{name} {value:.4g}" for name, value in scores[key].items())
        for key, numbers in seeds.items()
    ]
