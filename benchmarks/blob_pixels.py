"""`blob` from pixels: on PETS and on rendered scenes, with parts of it switched off.

usage: python benchmarks/blob_pixels.py [pets] [rendered] [above] [--data DIR] [--seeds 0:2]

pets: PETS09-S2L1-first200 (--data, default ../shared/data), boxes by IoU, and with View_001.xml the position on the
ground at 1 m (similarity 0.5 of 1 - d / 2 m). One table for backgrounds spread over the recording, one for causal ones.
rendered: catalogue scenes under a camera like PETS's (480 x 360, 7 frames/s, tilts of 15 and 20 degrees, JPEG at 80),
once with camera and empty background, once as bare video with a background spread over it.
above: from straight above at 20 px per m, and Friends Meet's scenes at 40, beside the same tracker on boxes.
Speed by parts: benchmarks/tracking_speed.py. Boxes over the pictures: flockscope overlay.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import tracking
from scenarios.loading.resolve import load
from sim.io.source import open_source
from sim.sequence import simulate
from sim.types import Frame, Sequence
from tracking.run import track

KEYS = "HOTA", "DetA", "AssA", "MOTA", "IDF1"
NEVER = {"split": False}
ABLATIONS = (
    ("blob", {}),
    ("no splitting, no person size", NEVER),
    ("nearest", {"association": "nearest"}),
    ("axes hardly expected (5 m)", {"person_noise": 5.0}),
    ("MOG2", {"segmentation": "mog2"}),
)
SCENES = (("street", 15), ("street", 20), ("cross", 15), ("mixed", 15), ("pillar", 20), ("split", 15), ("crowd", 20))
VIEW = ("image=[480,360]", "fps=7", "focal_px=600", "crop=true", "baseline=0")
FLAT = [(name, ['camera.kind="top"']) for name in ("merge", "cross")]
FRIENDS = [(f"scenarios/suites/friends-meet/{name}.toml", []) for name in ("merge", "queue", "hard-party")]
LONGEST = 120  # frames of a rendered scene


def row(title: str, scores: list[list[float]], speed: float = float("nan")) -> None:
    mean = np.mean(scores, 0)
    print(f"| {title} | " + " | ".join(f"{v:.3f}" for v in mean) + f" | {speed:.0f} |", flush=True)


def head(title: str) -> None:
    print(f"\n| {title} | " + " | ".join(KEYS) + " | frames/s |\n|---" + "|---" * (len(KEYS) + 1) + "|")


def one(
    sequence: Sequence, params: dict[str, object], similarity: str = "boxes", mode: str = "image"
) -> tuple[list[float], float]:
    run = track("blob", sequence, params=params, detections=mode)  # type: ignore[arg-type]
    assert sequence.truth is not None
    scores = tracking.evaluate(sequence.truth, run, similarity=similarity)
    return [scores[k] for k in KEYS], run.info["frames_per_second"]


def pets(folder: Path) -> None:
    for background in ("spread:50", "first:50"):
        head(f"PETS, background {background}")
        sequence = open_source(folder, images=True, background=background)[0]
        for title, params in ABLATIONS if background == "spread:50" else ABLATIONS[:1]:
            scores, speed = one(sequence, params)
            row(title, [scores], speed)
    head("PETS with View_001.xml, background spread:50")
    sequence = open_source(folder, images=True, camera=folder / "View_001.xml")[0]
    for similarity in ("boxes", "ground"):
        scores, speed = one(sequence, {}, similarity)
        row(similarity, [scores], speed)


def rendered(seeds: range) -> None:
    for bare in (False, True):
        made = [held(name, tilt, seed, bare) for name, tilt in SCENES for seed in seeds]
        head("rendered, " + ("bare video" if bare else "camera and empty background"))
        for title, params in ABLATIONS:
            found = [one(sequence, params) for sequence in made]
            row(title, [s for s, _ in found], float(np.mean([f for _, f in found])))


def held(name: str, tilt: int, seed: int, bare: bool) -> Sequence:
    """A rendered scene, its pictures in memory; people mostly out of view are no truth of a picture."""
    settings = [f"camera.{s}" for s in (f"tilt_deg={tilt}", *VIEW)]
    live = simulate(load(name, set=[*settings, "picture.jpeg=80"]), seed)
    frames = [f for f in live.frames() if f.index <= LONGEST]
    truth = live.truth
    assert truth is not None
    assert truth.truncation is not None
    keep = (truth.frame <= LONGEST) & (truth.truncation < 0.5)
    rows = ("frame", "id", "group", "pos", "vel", "box", "visibility", "z", "heading", "height", "truncation")
    cut = {k: getattr(truth, k)[keep] for k in (*rows, "visible_box") if getattr(truth, k) is not None}
    none = {"groups": None, "groups_px": None, "labelled": None, "events": None, "near": None, "orders": ()}
    seen = truth.replace(length=len(frames), **cut, **none)
    spread = [frames[k].image for k in np.linspace(0, len(frames) - 1, 50).astype(int)]

    def again() -> Iterator[Frame]:
        return iter(frames)

    video = replace(live, length=len(frames), frames=again, load_truth=lambda: seen, bare=None, load_pixels=None)
    if not bare:
        return video
    return replace(video, camera=None, scene=None, px_per_m=float("nan"), load_background=lambda: np.stack(spread))


def above(seeds: range) -> None:
    head("from straight above")
    for title, scenes in (("20 px per m", FLAT), ("Friends Meet, 40 px per m", FRIENDS)):
        made = [simulate(load(name, set=settings), seed) for name, settings in scenes for seed in seeds]
        for mode in ("image", "file"):
            found = [one(sequence, {}, mode=mode) for sequence in made]
            row(f"{title}, {'pixels' if mode == 'image' else 'boxes'}", [s for s, _ in found])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", nargs="*", default=["pets", "rendered"])
    parser.add_argument("--data", type=Path, default=Path(__file__).parents[2] / "shared" / "data")
    parser.add_argument("--seeds", default="0:2")
    given = parser.parse_args()
    folder = given.data / "mot" / "PETS09-S2L1-first200"
    if "pets" in given.what:
        pets(folder)
    if "rendered" in given.what:
        rendered(range(*(int(n) for n in given.seeds.split(":"))))
    if "above" in given.what:
        above(range(*(int(n) for n in given.seeds.split(":"))))


if __name__ == "__main__":
    main()
