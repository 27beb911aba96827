"""The folders into which a command writes the runs of a source's sequences."""

from __future__ import annotations

from pathlib import Path

from sim.io.files.output_paths import output_paths
from sim.types import Sequence


def run_folders(sequences: list[Sequence], source: Path, out: Path) -> list[Path]:
    """Returns the folder for each sequence's run."""
    own = Path(sequences[0].source.get("path", source))
    if len(sequences) == 1 and (own == source or source.is_file() or own.is_file()):
        return [out]
    return output_paths(out, [sequence.name for sequence in sequences], source=source)
