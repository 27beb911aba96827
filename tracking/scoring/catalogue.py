"""The catalogue of scores: what every key means, its unit and range, and which way is better.

`python -m tracking.scoring.catalogue` prints the table of docs/metrics.md.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import inf
from types import MappingProxyType
from typing import Literal

from tracking.scoring.events import HEADLINE, KINDS

Better = Literal["higher", "lower", "neither"]
CORE = "groups, core"


@dataclass(frozen=True)
class Score:
    """One key. unit: "1" for a share, "m | px" where it is the plane's; low, high: its range; family: its table;
    source: who defined it, "" for flockscope."""

    key: str
    family: str
    unit: str
    low: float
    high: float
    better: Better
    meaning: str
    source: str = ""

    @property
    def best(self) -> float:
        """What the truth itself would have as tracks; nan where that depends on it (counts of hits)."""
        value = {"higher": self.high, "lower": 0.0, "neither": inf}[self.better]
        return value if value < inf else float("nan")


def _share(key: str, family: str, meaning: str, low: float = 0.0) -> Score:
    return Score(key, family, "1", low, 1.0, "higher", meaning)


def _count(key: str, family: str, meaning: str, better: Better = "lower") -> Score:
    return Score(key, family, "count", 0.0, inf, better, meaning)


def _length(key: str, family: str, meaning: str, unit: str = "m | px") -> Score:
    return Score(key, family, unit, 0.0, inf, "lower", meaning)


def _from(source: str, *scores: Score) -> tuple[Score, ...]:
    return tuple(replace(score, source=source) for score in scores)


OBJECTIVE = (
    _share("objective", "objective", "mean of HOTA and group_F1_hull, or the one that is known: reward and tuning"),
)

HOTA = _from(
    "Luiten et al. 2021",
    _share("HOTA", "people", "geometric mean of DetA and AssA, mean over 19 thresholds of similarity"),
    _share("DetA", "people", "found people / all true or estimated people, mean over thresholds"),
    _share("AssA", "people", "how much of both identities' lives each match explains, mean over thresholds"),
    _share("DetRe", "people", "found / true people"),
    _share("DetPr", "people", "found / estimated people"),
    _share("AssRe", "people", "share of the true life that a match's pair of identities has in common"),
    _share("AssPr", "people", "share of the track's life that a match's pair of identities has in common"),
    _share("LocA", "people", "mean similarity of matches; 1 without any, as TrackEval has it"),
)

CLEAR = _from(
    "Bernardin & Stiefelhagen 2008",
    _share("MOTA", "people", "1 - (FN + FP + IDSW) / true people, at similarity 0.5", -inf),
    _share("MOTP", "people", "mean similarity of the matches of CLEAR (0.5 and more)"),
    _count("TP", "people", "people found at similarity 0.5", "higher"),
    _count("FN", "people", "people not found"),
    _count("FP", "people", "estimated people that are nobody"),
    _count("IDSW", "people", "a true person is matched with another track than the last time"),
    _count("MT", "people", "true people found in more than 80 % of their frames", "higher"),
    _count("PT", "people", "… in 20 to 80 %", "neither"),
    _count("ML", "people", "… in less than 20 %"),
    _count("Frag", "people", "a true person is found again after not being found"),
)

IDENTITY = _from(
    "Ristani et al. 2016",
    _share("IDF1", "people", "2 IDTP / (true + estimated people), identities assigned once for all"),
    _share("IDP", "people", "share of estimated people under the right identity"),
    _share("IDR", "people", "share of true people under the right identity"),
    _count("IDTP", "people", "estimated people under the right identity", "higher"),
)

ERRORS = (
    _length("RMSE_pos", "errors", "root mean square error of the places of people who are found (0.5 and more)"),
    _length("RMSE_vel", "errors", "… of their velocities, on the ground", "m/s"),
    *_from(
        "Rahmathullah et al. 2017",
        _length("GOSPA", "errors", "RMS over frames of GOSPA, cut-off 2 m: who is far off, missed and false"),
        _length("GOSPA_localisation", "errors", "its part of who is far off: GOSPA² is the sum of its parts' squares"),
        _length("GOSPA_missed", "errors", "its part of missed people"),
        _length("GOSPA_false", "errors", "its part of false people"),
    ),
)

GROUPS = (
    *_from(
        "Bazzani et al. 2012",
        _share("group_1-FP", "groups", "1 - false / true groups, sums over frames", -inf),
        _share("group_1-FN", "groups", "1 - missed / true groups, sums over frames"),
        _share("group_1-FP_frames", "groups", "1 - mean over frames of false / max(true groups, 1)", -inf),
        _share("group_1-FN_frames", "groups", "1 - mean over frames of missed / max(true groups, 1)"),
        _share("group_GDSR", "groups", "share of true groups that are matched with 60 % of their members inside"),
    ),
    _share("group_GDSR2", "groups", "… and 60 % of the estimated members right, so that one giant group is none"),
    *_from(
        "Bernardin & Stiefelhagen 2008",
        _length("group_MOTP", "groups", "mean distance of matched groups' middles"),
        _length("group_MSE", "groups", "mean square of that distance", "m² | px²"),
        _length("group_MOTP_ungated", "groups", "mean distance when groups are matched by distance alone, however far"),
        _share("group_MOTA", "groups", "1 - (FN + FP + IDSW) / true groups", -inf),
        _count("group_IDSW", "groups", "a true group is matched with another estimated id than the last time"),
        _count("group_TP", "groups", "matched groups", "higher"),
        _count("group_FP", "groups", "estimated groups without a match"),
        _count("group_FN", "groups", "true groups without a match"),
    ),
    _share("group_F1", "groups", "2 found / (true + estimated groups), found at similarity 0.5"),
    _share("group_precision", "groups", "found / estimated groups"),
    _share("group_recall", "groups", "found / true groups"),
    *(
        replace(score, key=f"group_{score.key}", family="groups", meaning=f"{score.key} of groups, same similarity")
        for score in HOTA
    ),
    Score(
        "group_size_error",
        "groups",
        "people",
        0.0,
        inf,
        "lower",
        "mean difference of estimated and true size, without sign",
    ),
    *_from(
        "Givens & Shortt 1984",
        _length("group_extent_error", "groups", "mean Wasserstein distance of matches, Gaussians of middle and extent"),
    ),
)

MEMBERS = (
    _share("group_F1_hull", "members", "group_F1 by hulls, whatever groups are matched by: half of the objective"),
    _share("pairwise_F1", "members", "2 right / (true + estimated) pairs of people in one group"),
    _share("pairwise_precision", "members", "right / estimated pairs; a pair with a track that is nobody is false"),
    _share("pairwise_recall", "members", "right / true pairs; a pair with a person nobody stands for is missed"),
)

LINEAGE = (
    _share("lineage_accuracy", "events", "share of true merges and splits told with the right parents and children"),
    _share("lineage_accuracy_found", "events", "the same share of those found"),
)


def _of_events(name: str, what: str) -> Iterable[Score]:
    yield _share(f"{name}_F1", "events", f"2 hits / (true + told) {what}")
    yield _share(f"{name}_precision", "events", f"hits / told {what}")
    yield _share(f"{name}_recall", "events", f"hits / true {what}")
    if name != "event":
        yield _count(f"{name}_TP", "events", f"{what} told rightly", "higher")
        yield _count(f"{name}_FP", "events", f"{what} told that did not happen")
        yield _count(f"{name}_FN", "events", f"{what} not told")
    yield Score(f"{name}_latency", "events", "s", -1.0, inf, "lower", f"mean from true start to telling of {what}")


def _headline(score: Score) -> Score:
    if score.key == "event_latency":
        return replace(score, meaning="mean from true start to telling of merges and splits")
    name = score.key.removeprefix("event_")
    return replace(score, meaning=f"mean of merge_{name} and split_{name}, of the one where only one is known")


def _plural(kind: str) -> str:
    return {"cross": "crossings", "merge": "merges", "split": "splits", "queue": "queues"}.get(kind, f"{kind} events")


def _core(score: Score) -> Score:
    return replace(score, key=f"{score.key}_core", family=CORE, meaning=f"{score.key} of the core")


ALL = (
    *OBJECTIVE,
    *HOTA,
    *CLEAR,
    *IDENTITY,
    *ERRORS,
    *GROUPS,
    *map(_core, GROUPS),
    *MEMBERS,
    *map(_headline, _of_events("event", " and ".join(map(_plural, HEADLINE)))),
    *(score for kind in KINDS for score in _of_events(kind, _plural(kind))),
    *LINEAGE,
)

CATALOGUE = MappingProxyType({score.key: score for score in ALL})
"""Every score by key, in the order in which they are shown."""


def table() -> str:
    """The catalogue in Markdown, family by family; the core's keys are those of the groups with `_core` behind."""
    lines = ["| key | unit | range | better | meaning | source |", "| --- | --- | --- | --- | --- | --- |"]
    for score in ALL:
        if score.family != CORE:
            unit = score.unit.replace("|", "or")
            cells = (f"`{score.key}`", unit, _range(score), score.better, score.meaning, score.source)
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _range(score: Score) -> str:
    low, high = (f"{v:g}".replace("inf", "∞").replace("-", "−") for v in (score.low, score.high))
    return f"{low} to {high}"


if __name__ == "__main__":
    print(table())
