"""Runs of `flockscope generate` as processes of their own, and hashes of the datasets that they write."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class GenerateRun:
    """Options of one run of `flockscope generate`.

    entries: scenarios and suites; seeds: "a:b"; more: further words of the command line; env: changed variables.
    """

    entries: Sequence[str]
    seeds: str
    workers: int = 1
    streams: str = "none"
    images: str = "jpg"
    more: Sequence[str] = ()
    env: Mapping[str, str] = field(default_factory=dict)

    def words(self, out: Path) -> list[str]:
        """Returns the arguments of the command that writes to the folder `out`."""
        words = ["generate", *self.entries, *self.more, "--seeds", self.seeds, "--out", str(out)]
        words += ["--workers", str(self.workers), "--json", "--streams", self.streams]
        return words if self.streams == "none" else [*words, "--images", self.images]

    def start(self, out: Path) -> subprocess.Popen[str]:
        """Starts the command in a session of its own, so that signals reach its program only."""
        return subprocess.Popen(
            [sys.executable, "-m", "tracking.app.cli", *self.words(out)],
            env={**os.environ, "PYTHONPATH": str(ROOT), **self.env}, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True, start_new_session=True,
        )  # fmt: skip

    def finish(self, out: Path) -> float:
        """Runs the command to its end and returns its wall seconds. Raises SystemExit if it fails."""
        begun = time.perf_counter()
        finished(self.start(out))
        return time.perf_counter() - begun

    def without_pictures(self) -> GenerateRun:
        """Returns the same run without any stream of pictures."""
        return replace(self, streams="none")


def finished(process: subprocess.Popen[str]) -> None:
    """Waits for a run. Raises SystemExit with the command and its output if its exit code is not 0."""
    answer = process.communicate()[0]
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, process.args))}: exit code {process.returncode}: {answer[:600]}")


def measured(process: subprocess.Popen[str]) -> tuple[float, float]:
    """Waits for a run; returns CPU seconds of it and its workers, and MB of the largest of these processes."""
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = status
    if status != 0:
        raise SystemExit(f"{' '.join(map(str, process.args))}: exit status {status}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def sequences(out: Path) -> list[Path]:
    """Returns the folders of sequences under their final names, complete or not."""
    return sorted(p for p in out.glob("flockscope-*/*/") if not p.name.startswith("."))


def complete(out: Path) -> list[Path]:
    """Returns the folders of sequences that have a manifest."""
    return [p for p in sequences(out) if (p / "manifest.json").is_file()]


def partial(out: Path) -> list[Path]:
    """Returns the folders of sequences that are being written, or that a dead process left."""
    return sorted(out.glob("flockscope-*/.partial-*"))


def file_bytes_hash(out: Path) -> str:
    """Returns one SHA-256 over the names and bytes of all files."""
    h = hashlib.sha256()
    for path in sorted(p for p in out.rglob("*") if p.is_file()):
        h.update(f"{path.relative_to(out)}\0".encode() + hashlib.sha256(path.read_bytes()).digest())
    return h.hexdigest()


def manifest_values(out: Path, key: str) -> dict[str, str]:
    """Returns one value of each manifest, for example "content_hash", by name of sequence."""
    return {p.name: json.loads((p / "manifest.json").read_text())[key] for p in complete(out)}
