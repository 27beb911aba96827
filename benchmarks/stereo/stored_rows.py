"""Rows of a benchmark in a JSON file, so that a long run can be made in parts."""

from __future__ import annotations

import json
from pathlib import Path

Row = dict[str, float]


class Stored:
    """Rows by scene, variant and seed; `path` None: in memory only.

    A file must come from the same command but for its seeds: what a variant's name stands for is not in it.
    """

    def __init__(self, path: Path | None) -> None:
        self.path = path
        known = json.loads(path.read_text(encoding="utf-8")) if path is not None and path.exists() else {}
        self.by: dict[str, dict[str, dict[str, Row]]] = known

    def has(self, scene: str, variant: str, seed: int) -> bool:
        """Returns True if there is a row."""
        return str(seed) in self.by.get(scene, {}).get(variant, {})

    def add(self, scene: str, variant: str, seed: int, row: Row) -> None:
        """Adds a row; returns nothing."""
        self.by.setdefault(scene, {}).setdefault(variant, {})[str(seed)] = {k: float(v) for k, v in row.items()}

    def rows(self, scene: str, variant: str) -> dict[int, Row]:
        """Returns the rows by seed, in the order of the seeds."""
        found = self.by.get(scene, {}).get(variant, {})
        return {seed: found[str(seed)] for seed in sorted(map(int, found))}

    def write(self) -> None:
        """Writes the file; returns nothing."""
        if self.path is not None:
            self.path.write_text(json.dumps(self.by), encoding="utf-8")
