"""Mode `management` of `benchmarks.blob`: how `blob` confirms and deletes tracks, as in the paper's Fig. 6.

First table: rho = sqrt|S| / its asymptote at birth, measurements in a row until a track is confirmed, and until rho is
within 5 % of its asymptote; with the default noises, and with ten times the process or measurement noise covariance.
Second table: one person at 10 frames/s who is seen, detected in two pieces (the paper's frame 367), jumps out of the
gate (its frame 357) and is lost. Each row is a frame: number of boxes, and id, rho and state of each track at its
prediction; * marks reported tracks.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sim.types import Context, Detections, Frame
from tracking.filters import track_uncertainty
from tracking.papers.blob.config import BlobConfig
from tracking.papers.blob.tracker import Blob

FPS = 10.0
WIDTH, HEIGHT = 28.0, 68.0  # px, a person at 40 px per m
PIECES, JUMP, LOST, END = range(20, 24), 30, 45, 64  # frames


def management() -> None:
    """Prints both tables."""
    rates()
    trace()


def rates() -> None:
    config = BlobConfig()
    print("          rho at birth              until confirmed            until rho <= 1.05")
    print("fps    default  10 Q  10 R      default  10 Q  10 R        default  10 Q  10 R")
    for fps in (2.5, 7.0, 10.0, 25.0, 30.0):
        nominal = config.dynamics(fps)
        made = (
            nominal,
            replace(nominal, sigma=nominal.sigma * np.sqrt(10)),
            replace(nominal, noise=nominal.noise * 10),
        )
        birth = "  ".join(f"{track_uncertainty.at_birth(d):6.2f}" for d in made)
        hits = [
            "  ".join(f"{track_uncertainty.hits_to_confirm(d, r):4d}" for d in made)
            for r in (config.confirm_ratio, 1.05)
        ]
        print(f"{fps:4g}   {birth}       {hits[0]}            {hits[1]}")


def boxes(frame: int) -> list[list[float]]:
    """Returns the boxes of the person in a frame: left, top, width, height, px."""
    x, y = 100 + 4.0 * frame + (200 if frame >= JUMP else 0), 200.0
    if frame >= LOST:
        return []
    if frame in PIECES:
        return [[x, y, WIDTH, HEIGHT / 2], [x, y + HEIGHT / 2, WIDTH, HEIGHT / 2]]
    return [[x, y, WIDTH, HEIGHT]]


def trace() -> None:
    tracker = Blob()
    tracker.reset(Context(fps=FPS, px_per_m=40.0, image_size=(1000, 600)), 0)
    print("frame  boxes  tracks: id rho state, * where reported")
    for k in range(1, END + 1):
        box = np.array(boxes(k)).reshape(-1, 4)
        found = Detections(k, (k - 1) / FPS, "image", box[:, :2] + box[:, 2:] / 2, None, box, np.ones(len(box)))
        answer = tracker.step(Frame(k, (k - 1) / FPS, detections=found), found)
        people, cells = tracker.people, []
        for i, id in enumerate(people.id.tolist()):
            state = "confirmed" if people.confirmed[i] else "tentative"
            state += "" if people.measured[i] else ", unseen"
            cells.append(f"{id} {people.rho[i]:6.2f} {state}{'*' if id in answer.id else ''}")
        print(f"{k:5d} {len(box):6d}  " + " | ".join(cells))
