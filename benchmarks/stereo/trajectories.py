"""Trajectories of groups in space, as in Figs. 5, 7 and 9 of the paper: an SVG.

A row per scene, of the first seed: on the left the paths seen from above, on the right the height of the groups against
time. Coloured: each reported group; grey: the mean position of the members of each true group, at a height of half a
person above the ground. Features lie mostly on the upper half of people, which the camera sees.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from pathlib import Path

import numpy as np

from benchmarks.stereo.scenes import entries, recordings
from benchmarks.support.chart import COLOURS
from tracking.run import track

SCENES = "cross,merge,stairs"
WIDTH, HEIGHT, EDGE = 400, 260, 40
MIDDLE = 0.85
"""m: half a person, the height of the middle of a body above the ground."""

Curves = dict[int, np.ndarray]


def trajectories(args: argparse.Namespace) -> dict[str, list[int]]:
    """Writes the SVG to args.chart and returns the ids of the reported groups by scene."""
    parts, made = [], {}
    for k, (name, entry) in enumerate(entries(args.only or SCENES).items()):
        ((seed, sequence),) = recordings(entry, args.seeds[:1])
        run = track("stereo", sequence, detections="image")
        found, true = _reported(run), _true(sequence)
        made[name] = sorted(found)
        top = k * HEIGHT
        parts += _panel(f"{name}, seed {seed}: from above", "x, m", "y, m", found, true, (1, 2), (0, top))
        parts += _panel(f"{name}: height", "time, s", "z, m", found, true, (0, 3), (WIDTH, top))
        print(name, seed, made[name])
    size = f'width="{2 * WIDTH}" height="{HEIGHT * len(made)}" viewBox="0 0 {2 * WIDTH} {HEIGHT * len(made)}"'
    style = '<style>text{font:12px sans-serif}polyline{fill:none}</style><rect width="100%" height="100%" fill="#fff"/>'
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{style}{"".join(parts)}</svg>\n'
    Path(args.chart).write_text(svg, encoding="utf-8")
    return made


def _reported(run) -> Curves:  # type: ignore[no-untyped-def]
    """Returns rows of t, x, y, z of each reported group by id."""
    found = defaultdict(list)
    for t in run:
        for id, pos in zip(t.id.tolist(), t.pos, strict=True):
            found[id].append([t.t, *pos])
    return {id: np.array(rows) for id, rows in found.items()}


def _true(sequence) -> Curves:  # type: ignore[no-untyped-def]
    """Returns rows of t, x, y, z of each true group by id; z is MIDDLE above the members' ground."""
    truth, found = sequence.truth, defaultdict(list)
    heights = {(f, i): z for f, i, z in zip(truth.frame.tolist(), truth.id.tolist(), truth.z.tolist(), strict=True)}
    for k, groups in enumerate(truth.groups):
        for id, pos, members in zip(groups.id.tolist(), groups.pos, groups.members, strict=True):
            z = np.mean([heights[k + 1, m] for m in members.tolist()]) + MIDDLE
            found[id].append([k / truth.fps, *pos, z])
    return {id: np.array(rows) for id, rows in found.items()}


def _panel(title, x_label, y_label, found: Curves, true: Curves, axes, corner) -> list[str]:  # type: ignore[no-untyped-def]
    """Returns SVG elements of one chart; axes: columns of the curves; corner: x, y of the upper left, px."""
    every = np.concatenate([c[:, axes] for c in (*found.values(), *true.values())])
    low, high = every.min(0) - 0.2, every.max(0) + 0.2
    scale = np.array([WIDTH - 1.5 * EDGE, HEIGHT - 2 * EDGE]) / (high - low)
    if axes[0] == 1:  # a map has one scale
        scale[:] = scale.min()

    def line(curve: np.ndarray, colour: str, width: float) -> str:
        at = (curve[::3, axes] - low) * scale
        x, y = corner[0] + EDGE + at[:, 0], corner[1] + HEIGHT - EDGE - at[:, 1]
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
        return f'<polyline points="{points}" stroke="{colour}" stroke-width="{width}"/>'

    def text(x: float, y: float, what: str) -> str:
        return f'<text x="{corner[0] + x:.0f}" y="{corner[1] + y:.0f}">{what}</text>'

    made = [text(EDGE, 20, title), text(WIDTH / 2, HEIGHT - 8, x_label), text(4, EDGE, y_label)]
    for axis in range(2):
        for value in np.arange(np.ceil(low[axis]), high[axis], max(np.ceil((high - low)[axis] / 6), 1)):
            at = (value - low[axis]) * scale[axis]
            place = (EDGE + at - 4, HEIGHT - EDGE + 16) if axis == 0 else (EDGE - 20, HEIGHT - EDGE - at + 4)
            made.append(text(*place, f"{value + 0:g}"))
    frame = f'x="{corner[0] + EDGE}" y="{corner[1] + EDGE}" width="{WIDTH - 1.5 * EDGE}" height="{HEIGHT - 2 * EDGE}"'
    made.append(f'<rect {frame} fill="none" stroke="#ccc"/>')
    made += [line(c, "#999", 3) for c in true.values()]
    return made + [line(c, COLOURS[k % len(COLOURS)], 1.5) for k, c in enumerate(found.values())]
