"""Numba kernels of the belief, in the order of its steps: evidence of pairs, sums of tables, share of mates, partition.

Evidence: exponential means over a pair's rows. Partition: linkage of groups in each step, with a memory of the step
before.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.elementary_kernels import find_root
from sim.types import Array, Bools, Ints


@njit(cache=True)
def add_to_means(
    step: Ints, pair: Ints, values: Array, times: Array, total: Array, weight: Array, last: Ints, rows: Ints,
    out: Array, count: Ints,
) -> None:  # fmt: skip
    """Adds rows (R,) of values (R, V) to the means of their pairs, in order, and writes the means after each to out.

    times (T,): in steps. total, weight (K, V, T), last, rows (K,): state by pair. out (R, V, T): nan before the first
    number; count (R,): the pair's rows so far.
    """
    fade = np.empty(len(times))
    for r in range(len(step)):
        k = pair[r]
        for n in range(len(times)):
            # the age of all former rows, applied once for each time
            fade[n] = np.exp(-(step[r] - last[k]) / times[n])
        last[k] = step[r]
        rows[k] += 1
        count[r] = rows[k]
        for v in range(values.shape[1]):
            x = values[r, v]
            known = not np.isnan(x)
            for n in range(len(times)):
                weight[k, v, n] = weight[k, v, n] * fade[n] + (1.0 if known else 0.0)
                total[k, v, n] = total[k, v, n] * fade[n] + (x if known else 0.0)
                out[r, v, n] = total[k, v, n] / weight[k, v, n] if weight[k, v, n] > 0 else np.nan


@njit(cache=True)
def table_sums(
    values: Array, noise: Array, levels: Array, bias: Array, column: Ints, cut: Ints, at: Array, heights: Array
) -> Array:
    """Returns the beliefs (R, D) of quantities (R, Q) at noise (R,): bias plus what each table says, 0 where a quantity
    is unknown.

    levels (L,), bias (D, L). cut (T + 1,): where the knots of each table begin in at (N,) and heights (D, L, N).
    """
    out = np.empty((len(values), len(bias)))
    for r in range(len(values)):
        low, more = _place(levels, 0, len(levels), noise[r])
        for d in range(len(bias)):
            out[r, d] = (1 - more) * bias[d, low] + more * bias[d, low + 1]
        for t in range(len(column)):
            x = values[r, column[t]]
            if not np.isnan(x):
                k, part = _place(at, cut[t], cut[t + 1], x)
                for d in range(len(bias)):
                    below, above = heights[d, low], heights[d, low + 1]
                    out[r, d] += (1 - more) * (below[k] + part * (below[k + 1] - below[k]))
                    out[r, d] += more * (above[k] + part * (above[k + 1] - above[k]))
    return out


@njit(cache=True)
def _place(at: Array, first: int, end: int, x: float) -> tuple[int, float]:
    """Returns the knot k of at[first:end] below x, at most the last but one, and which part of the way to the next x
    lies, 0 to 1."""
    k = first
    while k < end - 2 and at[k + 1] <= x:
        k += 1
    return k, min(max((x - at[k]) / (at[k + 1] - at[k]), 0.0), 1.0)


@njit(cache=True)
def shifts_of_share(
    step: Ints, pair: Ints, log_odds: Array, middle: Array, share: float, weight: float, latest: Ints, counts: Array,
    shift: Array, out: Array,
) -> None:  # fmt: skip
    """Counts each pair by its latest log-odds, and writes for each row (R,) by how much the log-odds of its step are to
    be shifted, out (R,).

    middle (B,): log-odds of the bins, evenly spaced. share, weight: share of mates where no pair is known, and as how
    many pairs it counts. State: latest (K,), bins of pairs, -1 for none; counts (B,); shift (1,).
    """
    low, width, usual = 0, middle[1] - middle[0], np.log(share / (1 - share))
    while low < len(step):
        high = low
        while high < len(step) and step[high] == step[low]:
            assert not np.isnan(log_odds[high])
            bin = int(min(max(np.floor((log_odds[high] - middle[0]) / width + 0.5), 0.0), len(middle) - 1.0))
            if latest[pair[high]] >= 0:
                counts[latest[pair[high]]] -= 1
            counts[bin] += 1
            latest[pair[high]] = bin
            high += 1
        for _ in range(2):  # the steps themselves are iterations, too
            mates, pairs = weight * share, weight
            for b in range(len(middle)):
                if counts[b] > 0:
                    mates += counts[b] / (1 + np.exp(-middle[b] - shift[0]))
                    pairs += counts[b]
            shift[0] = np.log(mates / (pairs - mates)) - usual
        out[low:high] = shift[0]
        low = high


@njit(cache=True)
def keep_missed(
    first: int,
    cut: Ints,
    row_pair: Ints,
    a: Ints,
    b: Ints,
    seen: Bools,
    reported: Bools,
    memory: int,
    gone: Ints,
    out: Ints,
) -> int:
    """Writes the pairs that keep their belief in steps in which one of the two is missed, and returns how many rows of
    out, (N, 2): step and pair, there are; all of them are counted if out is too small.

    first: number of the first of S steps. cut (S + 1,): where the rows of each step begin in row_pair (R,), the pairs
    with evidence. a, b (K,): people of each pair. seen, reported (S, P): who is seen, and who is reported at all.
    memory: steps for which a belief is kept after both were last reported. State, gone (K,): the step in which a pair
    was first reported no more; -1 as long as it is, -2 if it has no belief to keep.
    """
    count = 0
    for s in range(len(seen)):
        fresh = row_pair[cut[s] : cut[s + 1]]
        n = 0
        for k in range(len(gone)):
            if n < len(fresh) and fresh[n] == k:
                gone[k] = -1
                n += 1
            elif gone[k] > -2:
                if seen[s, a[k]] and seen[s, b[k]]:
                    gone[k] = -2
                    continue
                if gone[k] < 0 and not (reported[s, a[k]] and reported[s, b[k]]):
                    gone[k] = first + s
                if 0 <= gone[k] <= first + s - memory:
                    gone[k] = -2
                    continue
                if count < len(out):
                    out[count, 0], out[count, 1] = first + s, k
                count += 1
    return count


@njit(cache=True)
def linked_groups(
    cut: Ints, a: Ints, b: Ints, values: Array, unseen: float, stay: float, come: float, nearest: float, label: Ints
) -> None:
    """Finds the groups of each of S steps by linkage, with a memory of the step before.

    cut (S + 1,): where the rows of each step begin in a, b, values (R,). nearest: as of `_linkage`. label (S, P):
    filled with the lowest member of each person's group; -1, as given, where a person is alone.
    """
    # Only people whose value is positive with somebody can be in a group: the table of a step has these alone.
    # Connected components of such pairs are never joined, so that groups part whose pairs have no rows any more.
    steps, people = label.shape
    place, node, root = np.empty(people, np.int64), np.empty(people, np.int64), np.empty(people, np.int64)
    for p in range(people):
        place[p], root[p] = -1, p
    for s in range(steps):
        before = label[max(s - 1, 0)]
        rows = range(cut[s], cut[s + 1])
        for r in rows:
            if values[r] + _memory(before, a[r], b[r], stay, come) > 0:
                place[a[r]] = place[b[r]] = 0
                root[find_root(root, a[r])] = find_root(root, b[r])
        count = 0
        for p in range(people):
            if place[p] == 0:
                node[count], place[p] = p, count
                count += 1
        x = np.empty((count, count))
        for u in range(count):
            for v in range(count):
                known = find_root(root, node[u]) == find_root(root, node[v])
                x[u, v] = unseen + _memory(before, node[u], node[v], stay, come) if known else -np.inf
        for r in rows:
            u, v = place[a[r]], place[b[r]]
            if u >= 0 and v >= 0 and x[u, v] > -np.inf:
                x[u, v] = x[v, u] = values[r] + _memory(before, a[r], b[r], stay, come)
        group = _linkage(x, nearest)
        for u in range(count):
            place[node[u]], root[node[u]] = -1, node[u]
            for v in range(u):
                if group[v] == group[u]:
                    label[s, node[u]] = label[s, node[v]] = node[group[u]]


@njit(cache=True)
def _memory(before: Ints, p: int, q: int, stay: float, come: float) -> float:
    """Returns what is added to the value of two people; before (P,): labels of the step before."""
    return stay if before[p] >= 0 and before[p] == before[q] else -come


@njit(cache=True)
def _linkage(x: Array, nearest: float) -> Ints:
    """Returns the group (M,) of each person, its lowest member; x (M, M): values of pairs.

    Two groups are worth the mean over all their pairs times 1 - nearest, plus the mean over their people of the best
    value with somebody of the other group times nearest. The two that are worth most are joined.
    """
    count = len(x)
    size, group, best = np.empty(count), np.empty(count, np.int64), np.empty(count, np.int64)
    # by person and group: best value; by group and group: sum of these over the people of the first, and mean of all
    most, total, mean, worth = x.copy(), x.copy(), x.copy(), x.copy()
    for u in range(count):
        size[u], group[u] = 1.0, u
    for u in range(count):
        best[u] = _best_partner(worth, size, u)
    while True:
        u = -1
        for p in range(count):
            # each group remembers its best partner, so that most joins cost M operations
            if size[p] > 0 and best[p] >= 0 and (u < 0 or worth[p, best[p]] > worth[u, best[u]]):
                u = p
        if u < 0 or worth[u, best[u]] <= 0:
            return group
        u, v = min(u, best[u]), max(u, best[u])
        for q in range(count):
            if group[q] == v:
                group[q] = u
            if size[q] > 0 and q != u and q != v:
                mean[u, q] = mean[q, u] = (size[u] * mean[u, q] + size[v] * mean[v, q]) / (size[u] + size[v])
                total[u, q] += total[v, q]
                total[q, u] = 0.0
        size[u], size[v] = size[u] + size[v], 0.0
        for q in range(count):
            most[q, u] = max(most[q, u], most[q, v])
            if group[q] != u:
                total[group[q], u] += most[q, u]
        for q in range(count):
            if size[q] > 0 and q != u:
                best_pairs = (total[u, q] + total[q, u]) / (size[u] + size[q])
                # people who nobody connects are never joined
                known = mean[u, q] > -np.inf
                worth[u, q] = (1 - nearest) * mean[u, q] + nearest * best_pairs if known else -np.inf
                worth[q, u] = worth[u, q]
        for q in range(count):
            if size[q] > 0:
                if q == u or best[q] == u or best[q] == v:
                    best[q] = _best_partner(worth, size, q)
                elif best[q] >= 0 and worth[q, u] > worth[q, best[q]]:
                    best[q] = u


@njit(cache=True)
def _best_partner(x: Array, size: Array, u: int) -> int:
    found = -1
    for q in range(len(x)):
        if q != u and size[q] > 0 and (found < 0 or x[u, q] > x[u, found]):
            found = q
    return found
