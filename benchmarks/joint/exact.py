"""What eq. 5 is worth for two people: the exact posterior of its model, and what the decentralised filter has of it.

X is the places and velocities of two people, y their measured places, Z whether they are together. Here Z is a Markov
chain, and log p(Z | X) is 0. Given Z, all is linear and Gaussian, so that the posterior is a mixture of Kalman filters,
one for each history of Z. Histories that differ only more than HISTORY frames ago are merged by their moments.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.joint.runs import sequences
from benchmarks.joint.table2 import NUMBERS
from benchmarks.support import tables
from sim.rng import rng
from sim.types import Array, Bools, Ints, Truth
from tracking.filters.person_streams import PersonStreams
from tracking.papers.joint.config import SPEED_PRIOR, JointConfig
from tracking.papers.joint.decentralised_filter import Nested, advance
from tracking.papers.joint.distributions import BIRTHS, RESAMPLING, STATE, FrameModel
from tracking.papers.joint.individuals import process_noise
from tracking.stats import paired

HISTORY = 6  # With 8 no figure changes.
RATE = 0.1  # 1/s: of changes of Z.
PERIOD = 4.0  # s: between the starts of two gaps, in which the two people are hidden in turn.
FALSE = 1.0  # m: greatest error of a false point, per axis.
SURE = 2.0  # Log-odds of the belief in a known Z.
NOTHING = 1e12  # m^2: variance of the place of a person who is missed.


@dataclass(frozen=True)
class Condition:
    """params: of joint; gap: how long a person is hidden, s; missed: share of the other points; false: share of the
    missed in whose place there is a false point; drawn: X and Z are drawn from the model, not from the simulation."""

    params: Mapping[str, object] = field(default_factory=dict)
    gap: float = 1.0
    missed: float = 0.05
    false: float = 0.0
    drawn: bool = False


# Base: the default's Sigma and noise, 50 particles of 50 partitions, 5 % missed, a gap of 1 s every PERIOD.
CONDITIONS = {
    "base": Condition(),
    "X, Z drawn from the model": Condition(drawn=True),
    "gap 2 s": Condition(gap=2.0),
    "point_noise 0.24": Condition({"point_noise": 0.24}),
    "place_noise 0.05": Condition({"place_noise": 0.05}),
    "velocity_noise 1.5": Condition({"velocity_noise": 1.5}),
    "30 % missed, a third false": Condition(missed=0.3, false=0.33),
    "500 particles": Condition({"particles": 500}),
    "algorithm paper": Condition({"algorithm": "paper"}),
}
COLUMNS = (
    "VAR1 exact, cm", "Δ Z known", "Δ full exact", "VAR1 particles, cm", "Δ missed, Z known", "Δ full",
    "log loss of Z: prior / exact / particles",
)  # fmt: skip


def model_of(config: JointConfig, dt: float) -> tuple[Array, Array]:
    """Returns A (2, 4, 4) of p1, p2, v1, v2 on an axis, apart (eq. 3) and together (eq. 5), and Sigma (4, 4)."""
    step = np.stack([np.eye(4)] * 2)
    step[:, :2, 2:] = dt * np.eye(2), np.full((2, 2), dt / 2)
    place, cross, rate = process_noise(config.place_noise, config.velocity_noise, dt)
    return step, np.kron([[place, cross], [cross, rate]], np.eye(2))


def exact(y: Array, config: JointConfig, dt: float, z: Ints | None = None) -> tuple[Array, Array]:
    """Returns means of the places (T, S, 2, 2) and p(Z = 1) (T, S); y (T, S, person, axis), nan: missed; z (T, S): Z,
    where it is known."""
    people, count = y.shape[1], 2**HISTORY
    A, sigma = model_of(config, dt)
    before = np.arange(count) // (count // 2)  # of each history, newest frame first, its newest Z
    log_change = np.log(np.where(before == np.arange(2)[:, None], 1 - RATE * dt, RATE * dt))
    x, P = np.zeros((people, count, 4, 2)), np.zeros((people, count, 4, 4))
    x[:, :, :2], P[:] = y[0][:, None], np.diag([config.point_noise**2] * 2 + [SPEED_PRIOR**2] * 2)
    w, places, together = np.full((people, count), 1 / count), [y[0]], [np.full(people, 0.5)]
    for t in range(1, len(y)):
        x, P = A[:, None] @ x[:, None], A[:, None] @ P[:, None] @ A[:, None].transpose(0, 1, 3, 2) + sigma
        log_w = np.log(np.maximum(w, 1e-300))[:, None] + log_change
        if z is not None:
            log_w[z[t][:, None] != np.arange(2)] = -1e9
        for k in range(2):
            variance = np.where(np.isfinite(y[t, :, k, 0]), config.point_noise**2, NOTHING)[:, None, None]
            away = np.nan_to_num(y[t, :, k])[:, None, None] - x[..., k, :]
            S, row = P[..., k, k] + variance, P[..., k, :]
            log_w -= np.log(S) + (away**2).sum(axis=-1) / (2 * S)
            x = x + row[..., None] * (away / S[..., None])[..., None, :]
            P = P - row[..., None] * (row / S[..., None])[..., None, :]
        w = np.exp(log_w - log_w.max(axis=(1, 2), keepdims=True))
        w /= w.sum(axis=(1, 2), keepdims=True)
        places.append(np.einsum("szc,szckd->skd", w, x)[:, :2])
        together.append(w[:, 1].sum(axis=1))
        # merge histories whose oldest Z alone differs, the last bit of their number
        w, x, P = (a.reshape(people, count, 2, *a.shape[3:]) for a in (w, x, P))
        share = (w + 1e-300) / (w + 1e-300).sum(axis=2, keepdims=True)
        mean = np.einsum("sch,schkd->sckd", share, x)
        away = x - mean[:, :, None]
        P = np.einsum("sch,schkl->sckl", share, P + away @ away.swapaxes(-1, -2) / 2)  # one for both axes
        w, x = w.sum(axis=2), mean
    return np.array(places), np.array(together)


class PairModel(FrameModel):
    """The model of `exact` for the decentralised filter; log p(Z | X) is 0 without beliefs."""

    def groups(self, new: Array, x: Array, z: Ints) -> Ints:
        """Step 7: the Markov chain."""
        changed = self._of_partitions(z.shape, self.key[:1], 1)[..., 0] < RATE * self.dt
        return np.where(changed, 1 - z, z)


def particles(y: Array, config: JointConfig, dt: float, belief: Array, seed: int) -> tuple[Array, Array]:
    """Returns means of the places (T, 2, 2) and p(Z = 1) (T,) of one sequence by the decentralised filter; y (T, 2,
    2); belief (T,): log-odds of the pair."""
    streams, key, count = PersonStreams(seed), np.arange(2, dtype=np.uint64), config.particles
    nested = Nested.empty((count, config.partitions), STATE)
    start = streams.normals(BIRTHS, key, count, STATE) * np.repeat([config.point_noise, SPEED_PRIOR], 2)
    start[..., :2] += y[0]
    nested = nested.joined(start)
    nested.z[:, ::2] = 1
    places, together, own = [y[0]], [0.5], config.own_weights
    for t in range(1, len(y)):
        streams.frame = t
        model = PairModel(config, dt, config.point_noise, y[t], np.full((2, 2), belief[t]), streams, key)
        uniforms = streams.uniforms(RESAMPLING, key, count + 3, 1)[:, 0, 0]
        nested = advance(nested, model, uniforms[3:])
        places.append(np.einsum("ik,ikd->kd", nested.component_weights(own), nested.x[..., :2]))
        together.append(float(nested.weights(own) @ (np.exp(nested.log_q) * nested.z[..., 0]).sum(axis=1)))
        nested = nested.resampled(uniforms[:3], own)
    return np.array(places), np.array(together)


def all_particles(y: Array, config: JointConfig, dt: float, belief: Array, seed: int) -> tuple[Array, ...]:
    """Returns means of the places (T, S, 2, 2) and p(Z = 1) (T, S) of all sequences, each with a seed of its own."""
    runs = [particles(y[:, s], config, dt, belief[:, s], seed + s) for s in range(y.shape[1])]
    return tuple(np.stack(one, axis=1) for one in zip(*runs, strict=True))


def longest_pair(truth: Truth) -> tuple[Array, Ints]:
    """Returns places (T, 2, 2) and Z (T,) of the two people who are together longest, from their first common frame on;
    nan where a person is absent, as in the last frames."""
    ids = np.unique(truth.id)
    pos, group = np.full((truth.length, len(ids), 2), np.nan), np.full((truth.length, len(ids)), -1)
    at = truth.frame - 1, np.searchsorted(ids, truth.id)
    pos[at], group[at] = truth.pos, truth.group
    mates = (group[:, :, None] == group[:, None]) & (group[:, :, None] >= 0)
    shared = np.triu(mates.sum(axis=0), 1)
    a, b = np.unravel_index(shared.argmax(), shared.shape)
    first = int(np.isfinite(pos[:, [a, b], 0]).all(axis=1).argmax())
    pos[:first] = np.nan
    return np.roll(pos[:, [a, b]], -first, axis=0), np.roll(mates[:, a, b], -first).astype(int)


def drawn(config: JointConfig, dt: float, shape: tuple[int, int], draws: np.random.Generator) -> tuple[Array, Ints]:
    """Returns places (T, S, 2, 2) and Z (T, S) drawn from the model; shape: T, S."""
    A, sigma = model_of(config, dt)
    z = np.cumsum(draws.random(shape) < np.where(np.arange(shape[0]) > 0, RATE * dt, 0.5)[:, None], axis=0) % 2
    x = np.zeros((*shape, 4, 2))
    x[0, :, 2:] = SPEED_PRIOR * draws.standard_normal((shape[1], 2, 2))
    for t in range(1, shape[0]):
        x[t] = A[z[t]] @ x[t - 1] + np.linalg.cholesky(sigma) @ draws.standard_normal((shape[1], 4, 2))
    return x[:, :, :2], z


def measured(x: Array, config: JointConfig, dt: float, c: Condition, draws: np.random.Generator) -> tuple[Array, ...]:
    """Returns y as x, and who is seen, and who is in the last frame of a gap, (T, S, 2)."""
    y = x + config.point_noise * draws.standard_normal(x.shape)
    seen, last = np.isfinite(x[..., 0]) & (draws.random(x.shape[:3]) >= c.missed), np.zeros(x.shape[:3], bool)
    gap, period = round(c.gap / dt), round(PERIOD / dt)
    for turn, start in enumerate(range(period // 2, len(x) - gap, period)):
        seen[start : start + gap, :, turn % 2] = False
        last[start + gap - 1, :, turn % 2] = True
    seen[0], wrong = True, ~seen & ~last & (draws.random(seen.shape) < c.false)
    y[wrong] += draws.uniform(-FALSE, FALSE, y.shape)[wrong]
    y[~seen & ~wrong] = np.nan
    return y, seen, last & np.isfinite(x[..., 0])


def error(places: Array, x: Array, mask: Bools) -> Array:
    """Returns the root mean square error of each sequence where `mask` (T, S, 2) is True, cm, (S,)."""
    square = np.where(mask, ((places - x) ** 2).sum(axis=-1), 0.0).sum(axis=(0, 2))
    count = mask.sum(axis=(0, 2))
    return np.where(count > 0, 100 * np.sqrt(square / np.maximum(count, 1)), np.nan)


def log_loss(p: Array, z: Ints) -> str:
    """Returns the cell of the mean log loss of p(Z = 1) (T, S)."""
    return tables.number(float(-np.log(np.clip(np.where(z == 1, p, 1 - p), 1e-3, None)).mean()), 2)


def coupling(given: argparse.Namespace) -> None:
    """Prints root mean square errors of places, of seen people and at the end of gaps, differences to VAR1 of the same
    filter, paired over sequences, and the log loss of Z."""
    made = list(sequences(given.seeds))
    pairs, dt = [longest_pair(s.truth) for s in made if s.truth is not None], 1 / made[0].fps
    rows: dict[str, dict[str, list[str]]] = {"Seen people": {}, "Hidden people, in the last frame of a gap": {}}
    for name, c in CONDITIONS.items():
        config = JointConfig.from_dict(dict(c.params)).with_set(*given.set)
        draws = rng(given.seeds.start, "label", 3)
        x, z = (np.stack([pair[k] for pair in pairs], axis=1) for k in range(2))
        if c.drawn:
            x, z = drawn(config, dt, z.shape, draws)
        y, *masks = measured(x, config, dt, c, draws)
        found: list[tuple[Array, ...]] = [exact(y, config, dt, known) for known in (np.zeros_like(z), z, None)]
        for variant, sure in (("VAR1", 0), ("missed", SURE), ("full", 0)):
            own, belief = replace(config, variant=variant), sure * (2 * z - 1)
            found.append(all_particles(y, own, dt, belief, given.filter_seeds.start))
        losses = [log_loss(p, z) for p in (np.full(z.shape, z.mean()), found[2][1], found[5][1])]
        for cells, mask in zip(rows.values(), masks, strict=True):
            errors = [error(places, x, mask) for places, _ in found]
            alone, filtered = (f"{np.nanmean(errors[k]):.1f}" for k in (0, 3))
            compared = ((0, 1), (0, 2), (3, 4), (3, 5))
            deltas = [tables.difference_cell(errors[b] - errors[a], "RMSE_pos") for a, b in compared]
            cells[name] = [alone, *deltas[:2], filtered, *deltas[2:], " / ".join(losses)]
    for title, cells in rows.items():
        tables.table(f"{title}: {len(pairs)} pairs", "condition", COLUMNS, cells)


def by_number(given: argparse.Namespace) -> None:
    """Prints root mean square errors of two people, cm, by Algorithm 1 with one weight for a particle, by the number of
    particles, and by the exact posterior: VAR1, full, and their difference, paired over sequences."""
    made = list(sequences(given.seeds))
    dt, c, draws = 1 / made[0].fps, Condition(), rng(given.seeds.start, "label", 3)
    config = JointConfig(algorithm="paper").with_set(*given.set)
    x, z = (np.stack(one, axis=1) for one in zip(*(longest_pair(s.truth) for s in made if s.truth), strict=True))
    y, *masks = measured(x, config, dt, c, draws)
    found = {}
    for n in NUMBERS:
        own = [replace(config, variant=variant, particles=n) for variant in ("VAR1", "full")]
        found[f"N_x {n}"] = [all_particles(y, one, dt, np.zeros(z.shape), given.filter_seeds.start)[0] for one in own]
    found["exact"] = [exact(y, config, dt, known)[0] for known in (np.zeros_like(z), None)]
    cells: dict[str, list[str]] = {name: [] for name in found}
    for (name, both), mask in ((one, mask) for mask in masks for one in found.items()):
        alone, full = (error(places, x, mask) for places in both)
        means = (tables.number(float(np.nanmean(one)), 1) for one in (alone, full))
        cells[name] += [*means, tables.signed(*map(float, paired(alone, full)))]
    columns = [f"{who}: {what}" for who in ("seen", "hidden") for what in ("VAR1, cm", "full, cm", "full − VAR1")]
    tables.table(f"Two people, seen and in the last frame of a gap: {x.shape[1]} pairs", "filter", columns, cells)
