"""The libraries of the peers, each in a folder of its own, installed without their dependencies.

norfair asks for numpy 1, filterpy 1 and rich 14, with which flockscope does not work, but runs with those of
flockscope. So nothing that flockscope needs is installed twice, and all trackers run on the same numpy.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Sequence
from importlib.metadata import distributions
from pathlib import Path

# What each library imports beside flockscope's own packages; the first is the library.
PACKAGES = {
    "roboflow": ("trackers", "supervision", "pydeprecate", "pyyaml", "defusedxml", "tqdm", "requests", "urllib3",
                 "idna", "certifi", "charset-normalizer"),
    "norfair": ("norfair",),
    "stonesoup": ("stonesoup", "ordered-set", "rtree", "ruamel.yaml", "pymap3d", "utm"),
}  # fmt: skip
DEFAULT = Path.home() / ".cache" / "flockscope" / "peers"


def make_environments(folder: Path) -> dict[str, str]:
    """Installs all libraries that are not there yet, and returns the name and version of each, as `make_environment`
    does."""
    return {library: make_environment(folder, library, packages) for library, packages in PACKAGES.items()}


def make_environment(folder: Path, library: str, packages: Sequence[str]) -> str:
    """Installs packages into a folder of their own if they are not there yet, and puts it at the end of the search path
    of modules.

    Returns the name and version of the first package, "" if pip cannot install it; pip's reason goes to stderr.
    """
    place = folder / library
    if not place.is_dir():
        made = folder / f"{library}.unfinished"
        shutil.rmtree(made, ignore_errors=True)
        line = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", str(made), *packages]
        if subprocess.run(line, stdout=subprocess.DEVNULL, check=False).returncode:
            return ""
        made.rename(place)
    sys.path.append(str(place))
    versions = {one.name.lower(): one.version for one in distributions(path=[str(place)])}
    return f"{packages[0]} {versions[packages[0]]}"
