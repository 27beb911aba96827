"""The catalogue of scores: key, unit, range, which direction is better, meaning and source of every score.

`python -m tracking.scoring.catalogue` prints the table of docs/reference/metrics.md.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import inf
from types import MappingProxyType
from typing import Literal

from tracking.scoring.events import HEADLINE, KINDS

CORE = "groups, core"

Better = Literal["higher", "lower", "neither"]


@dataclass(frozen=True)
class Score:
    """One score of the catalogue."""

    key: str  # its name in the results, such as "HOTA"
    family: str  # name of the group of scores that are shown together, such as "people"
    # "1" for a share; "m | px" for a length in m on the ground or in px in the image ("m² | px²" squared); "m/s",
    # "count", "s", "people"
    unit: str
    # low, high: range of possible values; may be infinite
    low: float
    high: float
    better: Better  # whether "higher" or "lower" values are better, or "neither"
    meaning: str  # definition in words
    source: str = ""  # the paper that defines it, "" if flockscope does

    @property
    def best(self) -> float:
        """The value of a perfect tracker: `high` if higher is better, 0 if lower is better."""
        value = {"higher": self.high, "lower": 0.0, "neither": inf}[self.better]
        return value if value < inf else float("nan")


def share(key: str, meaning: str, low: float = 0.0) -> Score:
    """Returns a score of unit 1 from `low` to 1, higher is better, without family and source."""
    return Score(key, "", "1", low, 1.0, "higher", meaning)


def count(key: str, meaning: str, better: Better = "lower") -> Score:
    """Returns a number of 0 or more, without family and source."""
    return Score(key, "", "count", 0.0, inf, better, meaning)


def length(key: str, meaning: str, unit: str = "m | px") -> Score:
    """Returns an error of 0 or more in `unit`, lower is better, without family and source."""
    return Score(key, "", unit, 0.0, inf, "lower", meaning)


def in_family(family: str, *scores: Score) -> tuple[Score, ...]:
    """Returns the scores with the family `family`."""
    return tuple(replace(score, family=family) for score in scores)


def from_source(source: str, *scores: Score) -> tuple[Score, ...]:
    """Returns the scores with the source `source`."""
    return tuple(replace(score, source=source) for score in scores)


OBJECTIVE = in_family(
    "objective",
    share(
        "objective",
        "mean of HOTA and group_F1, or the one of the two that is known; used for tuning and as reward",
    ),
)

HOTA = in_family(
    "people",
    *from_source(
        "Luiten et al. 2021",
        share("HOTA", "geometric mean of DetA and AssA, mean over 19 thresholds of similarity"),
        share("DetA", "TP / (TP + FN + FP), mean over thresholds"),
        share("AssA", "mean over matches of: matches of the two ids / frames of either id, mean over thresholds"),
        share("DetRe", "matched / true people, mean over thresholds"),
        share("DetPr", "matched / estimated people, mean over thresholds"),
        share("AssRe", "mean over matches of: matches of the two ids / frames of the true id, mean over thresholds"),
        share("AssPr", "mean over matches of: matches of the two ids / frames of the track, mean over thresholds"),
        share(
            "LocA",
            "mean similarity of matches, mean over thresholds; 1 at a threshold without matches, as in TrackEval",
        ),
    ),
)

CLEAR = in_family(
    "people",
    *from_source(
        "Bernardin & Stiefelhagen 2008",
        share("MOTA", "1 - (FN + FP + IDSW) / true people, at similarity 0.5", -inf),
        share("MOTP", "mean similarity of the matches of CLEAR (similarity 0.5 or more)"),
        count("TP", "people matched at similarity 0.5, summed over frames", "higher"),
        count("FN", "true people without a match, summed over frames"),
        count("FP", "estimated people without a match, summed over frames"),
        count("IDSW", "identity switches: a true person is matched with another track than in its previous match"),
        count("MT", "mostly tracked: true people matched in more than 80 % of their frames", "higher"),
        count("PT", "partly tracked: true people matched in 20 to 80 % of their frames", "neither"),
        count("ML", "mostly lost: true people matched in less than 20 % of their frames"),
        count("Frag", "fragments: a true person is matched again after frames without a match"),
    ),
)

IDENTITY = in_family(
    "people",
    *from_source(
        "Ristani et al. 2016",
        share("IDF1", "2 IDTP / (true + estimated people)"),
        share("IDP", "IDTP / estimated people"),
        share("IDR", "IDTP / true people"),
        count(
            "IDTP",
            "matches of the best one-to-one assignment of true ids to tracks for the whole sequence, at similarity 0.5",
            "higher",
        ),
    ),
)

ERRORS = in_family(
    "errors",
    length("RMSE_pos", "root mean square error of positions, of people mapped at similarity 0.5 or more"),
    length("RMSE_vel", "root mean square error of velocities on the ground, of the same people", "m/s"),
    *from_source(
        "Rahmathullah et al. 2017",
        length(
            "GOSPA",
            "root mean square over frames of GOSPA with a cut-off of 2 m: localisation errors, missed and false people",
        ),
        length(
            "GOSPA_localisation", "the part of localisation errors; GOSPA² is the sum of the squares of the three parts"
        ),
        length("GOSPA_missed", "the part of missed people"),
        length("GOSPA_false", "the part of false people"),
    ),
)

GROUPS = in_family(
    "groups",
    *from_source(
        "Bazzani et al. 2012",
        share("group_1-FP", "1 - false / true groups, both summed over frames", -inf),
        share("group_1-FN", "1 - missed / true groups, both summed over frames"),
        share("group_1-FP_frames", "1 - mean over frames of false / max(true groups, 1)", -inf),
        share("group_1-FN_frames", "1 - mean over frames of missed / max(true groups, 1)"),
        share("group_GDSR", "share of true groups whose matched group contains at least 60 % of their members"),
    ),
    share(
        "group_GDSR2", "the same, if also at least 60 % of the estimated members are right; one giant group fails this"
    ),
    *from_source(
        "Bernardin & Stiefelhagen 2008",
        length("group_MOTP", "mean distance between the centres of matched groups"),
        length("group_MSE", "mean square of that distance", "m² | px²"),
        length("group_MOTP_ungated", "mean distance if groups are matched by distance alone, however far apart"),
        share("group_MOTA", "1 - (FN + FP + IDSW) / true groups", -inf),
        count("group_IDSW", "a true group is matched with another estimated id than in its previous match"),
        count("group_TP", "matched groups, summed over frames", "higher"),
        count("group_FP", "estimated groups without a match, summed over frames"),
        count("group_FN", "true groups without a match, summed over frames"),
    ),
    share(
        "group_F1",
        "2 found / (true + estimated groups); found: more than half of the people of both are in both; the headline",
    ),
    share("group_precision", "found / estimated groups"),
    share("group_recall", "found / true groups"),
    *(
        replace(
            score,
            key=f"group_{score.key}",
            meaning=f"{score.key} of groups, by the similarity by which groups are matched",
        )
        for score in HOTA
    ),
    length(
        "group_size_error",
        "mean absolute difference between estimated and true number of people, of matched groups",
        "people",
    ),
    *from_source(
        "Givens & Shortt 1984",
        length(
            "group_extent_error",
            "mean 2-Wasserstein distance of matched groups, taken as Gaussians with centre and extent",
        ),
    ),
)


def _groups_right(name: str, right: str) -> tuple[Score, ...]:
    p, r = f"{name}_precision", f"{name}_recall"
    return (
        share(f"{name}_F1", f"2 P R / (P + R) of P = {p} and R = {r}"),
        share(p, f"mean over frames of right / estimated groups; right: {right}"),
        share(r, "mean over frames of right / true groups"),
    )


MEMBERS = in_family(
    "members",
    share("group_F1_hull", "the same of hulls; found: matched at an IoU of 0.5 or more, which centimetres decide"),
    share("pairwise_F1", "2 right / (true + estimated pairs); a pair is two people of one frame in one group"),
    share("pairwise_precision", "right / estimated pairs; a pair with a track mapped to nobody is false"),
    share("pairwise_recall", "right / true pairs; a pair with a person no track is mapped to is missed"),
    *from_source(
        "Solera et al. 2016",
        share("GMITRE_F1", "G-MITRE: mean over frames of 2 right / (true + estimated links)"),
        share("GMITRE_precision", "mean over frames of right / estimated links"),
        share("GMITRE_recall", "mean over frames of right / true links"),
    ),
    *from_source(
        "Setti et al. 2015",
        *_groups_right("right_groups", "at least 2/3 of the n members are found, at most ⌈n / 3⌉ others (T = 2/3)"),
        *_groups_right("exact_groups", "all members are found, and nobody else (T = 1)"),
    ),
)

LINEAGE = (
    share(
        "lineage_accuracy", "share of true merges and splits that are matched and have the right parents and children"
    ),
    share("lineage_accuracy_found", "share of the matched merges and splits that have the right parents and children"),
)


def _of_events(name: str, what: str) -> Iterable[Score]:
    yield share(f"{name}_F1", f"2 matched / (true + reported) {what}")
    yield share(f"{name}_precision", f"matched / reported {what}")
    yield share(f"{name}_recall", f"matched / true {what}")
    if name != "event":
        yield count(f"{name}_TP", f"matched {what}", "higher")
        yield count(f"{name}_FP", f"reported {what} without a match")
        yield count(f"{name}_FN", f"true {what} without a match")
    latency = f"mean time from the true start to the report, of matched {what}"
    yield replace(length(f"{name}_latency", latency, "s"), low=-1.0)


def _headline(score: Score) -> Score:
    if score.key == "event_latency":
        return replace(score, meaning="mean time from the true start to the report, of matched merges and splits")
    name = score.key.removeprefix("event_")
    return replace(score, meaning=f"mean of merge_{name} and split_{name}, or the one of the two that is known")


def _plural(kind: str) -> str:
    return {"cross": "crossings", "merge": "merges", "split": "splits", "queue": "queues"}.get(kind, f"{kind} events")


def _core(score: Score) -> Score:
    return replace(
        score,
        key=f"{score.key}_core",
        family=CORE,
        meaning=f"{score.key} without frames up to 1 s before or after the start of a true merge or split",
    )


ALL = (
    *OBJECTIVE,
    *HOTA,
    *CLEAR,
    *IDENTITY,
    *ERRORS,
    *GROUPS,
    *map(_core, GROUPS),
    *MEMBERS,
    *in_family(
        "events",
        *map(_headline, _of_events("event", " and ".join(map(_plural, HEADLINE)))),
        *(score for kind in KINDS for score in _of_events(kind, _plural(kind))),
        *LINEAGE,
    ),
)

CATALOGUE = MappingProxyType({score.key: score for score in ALL})  # Every score by key, in display order.


def table() -> str:
    """Returns the catalogue as a Markdown table, one line per score, without core scores."""
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
