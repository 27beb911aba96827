"""Scores of people under weights of the frames: HOTA, CLEAR, Identity, RMSE and GOSPA.

`hota.py`, `clear.py`, `identity.py` and `position_errors.py` define these scores; here their sums are weighted.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array
from tracking.scoring.candidate_pairs import FOUND, Pairs, point_pairs
from tracking.scoring.clear import LOST, MOSTLY, clear_matches
from tracking.scoring.gospa import POWER, gospa_parts
from tracking.scoring.group_and_event_scores import ComparedSides
from tracking.scoring.hota import ALPHAS, LEAST, hota_matches
from tracking.scoring.matching import match
from tracking.scoring.position_errors import REACH, compared_positions
from tracking.scoring.weighted_sums import BinSums, FrameSums, WeightedScores, mean, ratio

CELLS = 2_000_000  # numbers of matches held at once


def weighted_people(pairs: Pairs, size: int) -> WeightedScores:
    """Returns the weighted scores of HOTA, CLEAR and Identity. Raises ValueError if an id is twice in a frame."""
    pairs.true.require_unique_ids("truth")
    pairs.est.require_unique_ids("tracks")
    parts = weighted_hota(pairs, size), weighted_clear(pairs, size), weighted_identity(pairs, size)
    return lambda weights: {key: value for part in parts for key, value in part(weights).items()}


def weighted_hota(pairs: Pairs, size: int) -> WeightedScores:
    """Returns the eight weighted scores of `hota`, with its matches kept."""
    matches, bins = hota_matches(pairs), len(ALPHAS) + 1
    used, link = np.unique(matches.link, return_inverse=True)
    true_id, est_id = matches.true_id[used], matches.est_id[used]
    true_rows = BinSums(pairs.true.frame, pairs.true_ids[1], len(pairs.true_ids[0]), size)
    est_rows = BinSums(pairs.est.frame, pairs.est_ids[1], len(pairs.est_ids[0]), size)
    met = BinSums(matches.frame, link * bins + matches.level, len(used) * bins, size)
    near = FrameSums(size)
    for k in range(1, bins):  # the sums of similarity at each threshold
        near.add(str(k), matches.frame, np.where(matches.level >= k, matches.s, 0.0))

    def score(weights: Array) -> dict[str, Array]:
        rows = max(1, CELLS // max(1, len(used) * bins))
        parts = [of_part(weights[k : k + rows]) for k in range(0, len(weights), rows)]
        return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]} if parts else {}

    def of_part(weights: Array) -> dict[str, Array]:
        n, m = true_rows.of(weights), est_rows.of(weights)
        together = met.of(weights).reshape(len(weights), len(used), bins)
        together = np.cumsum(together[:, :, :0:-1], axis=2)[:, :, ::-1]  # matches of each link at each threshold
        found = together.sum(axis=1)
        n_all, m_all = n.sum(axis=1)[:, None], m.sum(axis=1)[:, None]
        n, m = n[:, true_id, None], m[:, est_id, None]

        def mean_share(of: Array) -> Array:
            return ratio(ratio(together * together, np.broadcast_to(of, together.shape), 0.0).sum(axis=1), found, 0.0)

        det, ass = ratio(found, n_all + m_all - found, 0.0), mean_share(n + m - together)
        similar = np.column_stack(list(near.of(weights).values()))
        curves = {
            "HOTA": np.sqrt(det * ass), "DetA": det, "AssA": ass,
            "DetRe": ratio(found, np.broadcast_to(n_all, found.shape), 0.0),
            "DetPr": ratio(found, np.broadcast_to(m_all, found.shape), 0.0),
            "AssRe": mean_share(n), "AssPr": mean_share(m),
            "LocA": np.maximum(LEAST, similar) / np.maximum(LEAST, found),
        }  # fmt: skip
        return {key: curve.mean(axis=1) for key, curve in curves.items()}

    return score


def weighted_clear(pairs: Pairs, size: int) -> WeightedScores:
    """Returns the ten weighted scores of `clear`, with its matches kept."""
    matches, sums = clear_matches(pairs), FrameSums(size)
    sums.add("true", pairs.true.frame)
    sums.add("est", pairs.est.frame)
    sums.add("TP", matches.found.frame)
    sums.add("similarity", matches.found.frame, matches.found.s)
    sums.add("IDSW", matches.switched)
    sums.add("Frag", matches.resumed)
    who, share = pairs.true_ids[1], matches.share
    part = 1 / np.bincount(who)[who]
    kinds = {"MT": share > MOSTLY, "PT": (share >= LOST) & (share <= MOSTLY), "ML": share < LOST}
    for key, inside in kinds.items():
        sums.add(key, pairs.true.frame, part * inside[who])

    def score(weights: Array) -> dict[str, Array]:
        s = sums.of(weights)
        n, m, hits = s["true"], s["est"], s["TP"]
        quality = ratio(hits - (m - hits) - s["IDSW"], n, 0.0)
        return {
            "MOTA": np.where(m > 0, quality, 0.0), "MOTP": ratio(s["similarity"], hits, 0.0),
            "TP": hits, "FN": n - hits, "FP": m - hits,
            **{key: s[key] for key in ("IDSW", "MT", "PT", "ML", "Frag")},
        }  # fmt: skip

    return score


def weighted_identity(pairs: Pairs, size: int) -> WeightedScores:
    """Returns the weighted IDF1, IDP, IDR and IDTP; ids are assigned anew for each draw."""
    near = pairs.s >= FOUND
    true_id, est_id, link = pairs.links
    common = BinSums(pairs.frame[near], link[near], len(true_id), size)
    sums = FrameSums(size)
    sums.add("true", pairs.true.frame)
    sums.add("est", pairs.est.frame)

    def assigned(frames: Array) -> float:
        some = frames > 0
        i, j, weight = true_id[some], est_id[some], frames[some]
        return float(weight[match(np.zeros_like(i), i, j, weight)].sum())

    def score(weights: Array) -> dict[str, Array]:
        s, found = sums.of(weights), np.array([assigned(frames) for frames in common.of(weights)])
        n, m = s["true"], s["est"]
        return {
            "IDF1": ratio(2 * found, n + m, 0.0), "IDP": ratio(found, m, 0.0), "IDR": ratio(found, n, 0.0),
            "IDTP": found,
        }  # fmt: skip

    return score


def weighted_positions(sides: ComparedSides) -> WeightedScores:
    """Returns the weighted RMSE_pos, RMSE_vel, GOSPA and its parts; {} without positions on the surface."""
    true, est = sides.true, sides.est
    compared = compared_positions(true, est, sides.surface, sides.plane, sides.scale)
    if compared is None:
        return lambda weights: {}
    true_pos, est_pos, true_vel, est_vel = compared
    sums, reach = FrameSums(len(sides.inside)), REACH * sides.scale
    j = np.flatnonzero(sides.mapping >= 0)
    i = sides.mapping[j]
    sums.add_mean("RMSE_pos", true.rows.frame[i], np.square(est_pos[j] - true_pos[i]).sum(axis=1))
    off = np.full((len(i), 2), np.nan) if true_vel is None or est_vel is None else est_vel[j] - true_vel[i]
    sums.add_mean("RMSE_vel", true.rows.frame[i], np.square(off).sum(axis=1))
    parts = gospa_parts(point_pairs(true.rows, est.rows, true_pos, est_pos, reach), reach)
    for name, values in zip(("localisation", "missed", "false"), parts.T, strict=True):
        sums.add(name, np.arange(len(parts)), values)
    sums.add("frames", np.flatnonzero(sides.inside))

    def score(weights: Array) -> dict[str, Array]:
        s = sums.of(weights)
        root = {name: ratio(s[name], s["frames"]) for name in ("localisation", "missed", "false")}
        return {
            **{key: np.sqrt(mean(s, key)) for key in ("RMSE_pos", "RMSE_vel")},
            "GOSPA": (root["localisation"] + root["missed"] + root["false"]) ** (1 / POWER),
            **{f"GOSPA_{name}": value ** (1 / POWER) for name, value in root.items()},
        }

    return score
