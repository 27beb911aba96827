"""Mode `calibration` of `benchmarks.belief`: how often people are together whom the belief holds to be.

Probability and share of mates by bin, expected calibration error, all scenes weighing the same; --out: the same as a
reliability plot.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.support.chart import Panel, lines
from benchmarks.support.tables import head, number, row
from tracking.fitting.belief import sample_of, shifts_of_sample
from tracking.fitting.belief_scores import BINS, belief_scores, reliability
from tracking.fitting.grouping_scenes import pair_scenes
from tracking.grouping.belief import Belief


def calibration(names: Sequence[str], seeds: range, belief: Belief, out: Path | None) -> None:
    panels = []
    for name in names:
        sample = sample_of(list(pair_scenes([name], seeds)))
        log_odds = belief.log_odds(sample.values, sample.noise)[:, 0]
        log_odds += shifts_of_sample(sample, log_odds, belief.share)
        scores, bins = belief_scores(sample, log_odds), reliability(log_odds, sample.together, sample.weight)
        words = [f"{key} {value:.0f}" if key == "pairs" else f"{key} {value:.3f}" for key, value in scores.items()]
        print(f"\n{Path(name).stem}: {', '.join(words)}")
        head(["probability", "share of rows", "mean probability", "share of mates"])
        for k, (share, mean, mates) in enumerate(bins):
            row([f"{k / BINS:.2f}–{(k + 1) / BINS:.2f}", number(share, 4), number(mean), number(mates)])
        known = bins[bins[:, 0] > 0]
        curves = {"belief": known[:, 2], "as it should be": known[:, 1]}
        title = f"{Path(name).stem}: calibration error {scores['calibration error']:.3f}"
        panels.append(Panel(title, known[:, 1].tolist(), curves, "probability", "share of mates", (0.0, 1.0)))
    if out is not None:
        lines(panels, out)
