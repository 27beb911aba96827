"""What the bytes of a result depend on besides its inputs: versions of Python and libraries, and our own source files.

Motion, truth and simulated detections do not depend on the processor (`sim.elementary`). The last bits of pictures and
of trackers may.
"""

from __future__ import annotations

import hashlib
import platform
from functools import cache, lru_cache
from importlib import metadata
from pathlib import Path

LIBRARIES = ("numpy", "scipy", "numba", "pymunk", "pyarrow", "pydantic")
PICTURE_LIBRARIES = ("opencv-python-headless", "av")
DISTRIBUTION = "flockscope"


@lru_cache(maxsize=2)
def versions(drawn: bool) -> dict[str, str]:
    """Return the versions of Python, flockscope and the libraries we compute with, by name; "unknown" if not installed.

    The names are "python", "flockscope", "numpy", "scipy", "numba", "pymunk", "pyarrow" and "pydantic". drawn: include
    "opencv-python-headless" and "av", on which the bytes of pictures depend. The dict is cached: do not modify it.
    """
    found = {"python": platform.python_version()}
    for name in (DISTRIBUTION, *LIBRARIES, *(PICTURE_LIBRARIES if drawn else ())):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "unknown"
    return found


@cache
def runtime() -> dict[str, str]:
    """Return everything that two machines must share to produce the same bytes, as name to value.

    The names are those of `versions(drawn=True)` ("python", "numpy", …), whose values are version numbers, "sources"
    (hash of our source files, 12 hex digits). Computed once and cached: do not modify the dict.
    """
    root = Path(__file__).resolve().parents[1]
    return {**versions(drawn=True), "sources": source_hash(root)}


def packages() -> tuple[str, ...]:
    """Return the top-level packages of the installed flockscope, sorted; normally ("scenarios", "sim", "tracking").

    If it is not installed, or does not list its packages: ("scenarios", "sim"), those that simulating needs.
    """
    try:
        listed = metadata.distribution(DISTRIBUTION).read_text("top_level.txt")
    except metadata.PackageNotFoundError:
        listed = None
    return tuple(sorted(listed.split())) if listed else ("scenarios", "sim")


def source_hash(root: Path) -> str:
    """Return 12 hex digits of the SHA-256 over the source files of our packages in the folder `root`.

    All .py and .toml files below root/<package> count, for each of `packages()` ("scenarios", "sim" and, if installed,
    "tracking"), by relative name and bytes. A missing package counts as empty. Raises OSError for an unreadable file.
    """
    h = hashlib.sha256()
    for package in packages():
        for path in sorted((root / package).rglob("*")):
            if path.suffix in (".py", ".toml"):
                h.update(f"{path.relative_to(root).as_posix()}\0".encode() + path.read_bytes() + b"\0")
    return h.hexdigest()[:12]
