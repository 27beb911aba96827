"""What the benchmarks of `generate` share: starting the command as users do, and one hash over what it made."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Pictures:
    """`--streams` and `--images` of `flockscope generate`."""

    streams: str = "none"
    images: str = "jpg"


NONE = Pictures()


def start(
    entries: Sequence[str],
    seeds: str,
    out: Path,
    workers: int,
    pictures: Pictures = NONE,
    more: Sequence[str] = (),
    **env: str,
) -> subprocess.Popen[str]:
    """`flockscope generate` as a process of its own, of its own session; more: further words; env: what differs."""
    words = ["generate", *entries, *more, "--seeds", seeds, "--out", str(out), "--workers", str(workers), "--json"]
    words += ["--streams", pictures.streams]
    words += [] if pictures == NONE else ["--images", pictures.images]
    variables = {**os.environ, "PYTHONPATH": str(ROOT), **env}
    return subprocess.Popen(
        [sys.executable, "-m", "tracking.app.cli", *words],
        env=variables, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True,
    )  # fmt: skip


def whole_run(
    entries: Sequence[str],
    seeds: str,
    out: Path,
    workers: int,
    pictures: Pictures = NONE,
    more: Sequence[str] = (),
    **env: str,
) -> float:
    """Wall seconds of a run that must end well."""
    begin = time.perf_counter()
    process = start(entries, seeds, out, workers, pictures, more, **env)
    answer = process.communicate()[0]
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, process.args))}: exit code {process.returncode}: {answer[:600]}")
    return time.perf_counter() - begin


def sequences(out: Path) -> list[Path]:
    """Folders of sequences that stand in their place, complete or not."""
    return sorted(p for p in out.glob("flockscope-*/*/") if not p.name.startswith("."))


def complete(out: Path) -> list[Path]:
    """Those with a manifest."""
    return [p for p in sequences(out) if (p / "manifest.json").is_file()]


def file_bytes_hash(out: Path) -> str:
    """One hash over the names and bytes of all files."""
    h = hashlib.sha256()
    for path in sorted(p for p in out.rglob("*") if p.is_file()):
        h.update(f"{path.relative_to(out)}\0".encode() + hashlib.sha256(path.read_bytes()).digest())
    return h.hexdigest()


def manifest_values(out: Path, key: str) -> dict[str, str]:
    """A key of the manifests by name of sequence."""
    return {p.name: json.loads((p / "manifest.json").read_text())[key] for p in complete(out)}


def content_hashes(out: Path) -> dict[str, str]:
    """Content hash by name of sequence, as their manifests say."""
    return manifest_values(out, "content_hash")
