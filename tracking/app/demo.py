"""`flockscope demo`: from a scene to a page with scores, start to finish."""

from __future__ import annotations

from pathlib import Path

from scenarios.loading import resolve
from sim.generate import generate
from sim.io.source import open_source
from tracking import evaluate, track
from tracking.app.answer import Answer
from tracking.app.view import view
from tracking.protocol import names

SEED = 40_000
SCENES = ("merge", "split", "cross", "queue")


def demo(out: Path, *, quick: bool) -> Answer:
    """Generate, track with every tracker, score; a page for each scene, the first one's path last."""
    scenes = SCENES[:1] if quick else SCENES
    entries = [entry for name in scenes for entry in resolve(name)]
    folders = generate(entries, range(SEED, SEED + 1), out)
    rows, pages = [], []
    for sequence in (s for folder in folders for s in open_source(folder)):
        assert sequence.truth is not None
        for tracker in names():
            tracks = track(tracker, sequence)
            scores = evaluate(sequence.truth, tracks)
            page = out / f"{sequence.name}-{tracker}.html"
            view(sequence, tracks, page, scores=scores)
            pages.append(page)
            rows.append({"sequence": sequence.name, "tracker": tracker, **scores})
    lines = [
        f"{r['sequence']:<24} {r['tracker']:<10} " + "  ".join(_figure(r, k) for k in ("HOTA", "MOTA", "IDF1"))
        for r in rows
    ]
    return Answer(
        {"scores": rows, "pages": [str(p) for p in pages]}, "\n".join([*lines, "", f"open {pages[0].resolve()}"])
    )


def _figure(row: dict[str, object], key: str) -> str:
    return f"{key} {row[key]:.3f}"
