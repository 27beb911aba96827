"""Mode `earlier` of `benchmarks.group_pda`: the tracker against itself at an earlier commit (--commit), paired.

The folder of the tracker is taken from git as it was at that commit; everything else is of today. Both track the same
sequences, and seq_hotel, zara01 and Meet_WalkTogether1 (--data). Tables: differences (today less earlier) of each scene
and of all together; * if 0 lies outside the interval; of IDSW less is better.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import subprocess
import tarfile
from pathlib import Path
from tempfile import gettempdir
from typing import Any

from benchmarks.group_pda import columns
from benchmarks.group_pda.recordings import KEYS, paired_on_recording
from benchmarks.group_pda.runs import Variant
from benchmarks.group_pda.scenes import DECIDED, gathered, heading
from benchmarks.support.options import HOTEL, WALK_TOGETHER, ZARA
from benchmarks.support.tables import signed, table
from scenarios.loading.resolve import resolve
from sim.io.source import open_source
from tracking.run import track
from tracking.stats import paired

SCENES = ("merge", "split", "cross", "side-by-side", "suite:friends-meet")
RECORDINGS = {"hotel": HOTEL, "zara": ZARA, "caviar": WALK_TOGETHER}
FOLDER = "tracking/papers/group_pda"


def earlier_tracker(commit: str) -> str:
    """Returns the name by which the tracker of a commit is found; its files are written into a temporary folder.

    The folder is kept for the next run, as its kernels take a minute to compile.
    """
    root = Path(__file__).resolve().parents[2]
    packed = subprocess.run(["git", "archive", commit, FOLDER], cwd=root, check=True, capture_output=True).stdout
    package = f"group_pda_{hashlib.sha256(packed).hexdigest()[:12]}"
    folder = Path(gettempdir()) / f"flockscope-{package}"
    (folder / package).mkdir(parents=True, exist_ok=True)
    with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
        for member in archive:
            if member.name.endswith(".py"):
                content = archive.extractfile(member)
                assert content is not None
                text = content.read().decode().replace(FOLDER.replace("/", "."), package)
                (folder / package / Path(member.name).name).write_text(text, encoding="utf-8")
    entry = folder / f"{package}_tracker.py"
    entry.write_text(f"from {package}.tracker import GroupPda as GroupPda\n", encoding="utf-8")
    return f"{entry}:GroupPda"


def earlier(given: argparse.Namespace) -> Any:
    """Prints the differences; returns the rows by scene and tracker, of recordings the differences."""
    names = given.only.split(",") if given.only else [*SCENES, *RECORDINGS]
    before = earlier_tracker(given.commit)
    found: dict[str, Any] = {name: on_recording(given, name, before) for name in names if name in RECORDINGS}
    entries = [entry for name in names if name not in RECORDINGS for entry in resolve(name)]
    if not entries:
        return found
    scenes = gathered(entries, given, (Variant(given.commit, before), Variant("today", given.tracker)))
    pooled = {v: [row for rows in scenes.values() for row in rows[v]] for v in (given.commit, "today")}
    for scene, rows in {**scenes, "all": pooled}.items():
        old, new = (columns.values(rows[v], DECIDED) for v in (given.commit, "today"))
        cells = {v: [columns.mean_of(key)(rows[v]) for key in DECIDED] for v in rows}
        cells["difference"] = [signed(*(float(e[k]) for e in paired(old, new))) for k in range(len(DECIDED))]
        title = f"{scene}: {heading(given, rows)}; paired differences"
        table(title, "", ["ids kept" if key == "ids" else key for key in DECIDED], cells)
    return found | scenes


def on_recording(given: argparse.Namespace, name: str, before: str) -> list[tuple[float, float, float]]:
    """Prints and returns the differences on one recording: value, low and high end of each score."""
    sequence = open_source(given.data / RECORDINGS[name])[0]
    assert sequence.truth is not None
    old, new = (track(tracker, sequence, detections="truth") for tracker in (before, given.tracker))
    found = paired_on_recording(sequence.truth, old, new, KEYS)
    columns_of = [key.removeprefix("group_") for key in KEYS]
    table(f"{sequence.name}, today less {given.commit}", "", columns_of, {"difference": [signed(*e) for e in found]})
    return found
