"""What the bytes of a result depend on besides its inputs: versions of Python and libraries, and our own source files.

Motion, truth and simulated detections do not depend on the processor (`sim.elementary`). The last bits of pictures and
of trackers may.
"""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable
from functools import cache, lru_cache
from importlib import metadata
from pathlib import Path

LIBRARIES = ("numpy", "scipy", "numba", "pymunk", "pyarrow", "pydantic")
PICTURE_LIBRARIES = ("opencv-python-headless", "av")
DISTRIBUTION = "flockscope"


@lru_cache(maxsize=2)
def versions(drawn: bool) -> dict[str, str]:
    """Returns the versions of Python, flockscope and libraries, by name; `drawn` adds those that pictures depend on."""
    names = (DISTRIBUTION, *LIBRARIES, *(PICTURE_LIBRARIES if drawn else ()))
    return {"python": platform.python_version(), **installed(names)}


def installed(names: Iterable[str]) -> dict[str, str]:
    """Returns the versions of installed distributions by name, "unknown" of others."""
    found = {}
    for name in names:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "unknown"
    return found


@cache
def runtime() -> dict[str, str]:
    """Returns everything that two machines must share to produce the same bytes, by name."""
    root = Path(__file__).resolve().parents[1]
    return {**versions(drawn=True), "sources": source_hash(root)}


def packages() -> tuple[str, ...]:
    """Returns the top-level packages of the installed flockscope, else those that simulating needs."""
    try:
        listed = metadata.distribution(DISTRIBUTION).read_text("top_level.txt")
    except metadata.PackageNotFoundError:
        listed = None
    # An installation may leave `tracking` out.
    return tuple(sorted(listed.split())) if listed else ("scenarios", "sim")


def source_hash(root: Path) -> str:
    """Returns 12 hex digits of the SHA-256 over the source files of our packages in the folder `root`."""
    h = hashlib.sha256()
    for package in packages():
        for path in sorted((root / package).rglob("*")):
            if path.suffix in (".py", ".toml"):
                h.update(f"{path.relative_to(root).as_posix()}\0".encode() + path.read_bytes() + b"\0")
    return h.hexdigest()[:12]
