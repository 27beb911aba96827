"""Compiled connected components of linked people."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit


@njit(cache=True)
def connected_people(frame, column, length, people, memory, when, a, b, on):  # type: ignore[no-untyped-def]
    """Returns a label for each of R rows (people in frames), shared by connected people of a frame, -1 alone.

    Links switch on or off in frames `when` (L,), sorted, between columns a and b. Someone missed for at most `memory`
    frames still connects others. The groups are those of group_labels.label_people, without its ids.
    """
    linked = np.zeros((people, people), np.bool_)
    seen, label, stack, size = np.empty((4, people), np.int64)
    out = np.empty(len(frame), np.int64)
    for p in range(people):
        seen[p] = -memory - 2
    # rows and switches are sorted by frame: one pass over both
    row, link = 0, 0
    for t in range(length):
        first = row
        while row < len(frame) and frame[row] == t:
            seen[column[row]] = t
            row += 1
        while link < len(when) and when[link] == t:
            linked[a[link], b[link]] = linked[b[link], a[link]] = on[link]
            link += 1
        for p in range(people):
            label[p], size[p] = -1, 0
        for k in range(first, row):
            p = column[k]
            if label[p] < 0:
                _spread(p, linked, seen, t - memory, label, stack)
            size[label[p]] += 1
        for k in range(first, row):
            out[k] = label[column[k]] if size[label[column[k]]] > 1 else -1
    return out


@njit(cache=True)
def _spread(p, linked, seen, since, label, stack):  # type: ignore[no-untyped-def]
    """Sets label[q] = p for p and all people connected to p and seen in frame `since` or later."""
    stack[0], n, label[p] = p, 1, p
    while n:
        n -= 1
        q = stack[n]
        for r in range(len(seen)):
            if linked[q, r] and label[r] < 0 and seen[r] >= since:
                label[r] = p
                stack[n] = r
                n += 1
