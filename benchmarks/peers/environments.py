"""The libraries of the peers, each in a folder of its own, installed without their dependencies.

norfair asks for numpy 1, filterpy 1 and rich 14, with which flockscope does not work, but runs with those of
flockscope. So nothing that flockscope needs is installed twice, and all trackers run on the same numpy.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterable
from importlib.metadata import distributions
from pathlib import Path

# What each library imports beside flockscope's own packages; the first is the library.
PACKAGES = {
    "roboflow": ("trackers", "supervision", "pydeprecate", "pyyaml", "defusedxml", "tqdm", "requests", "urllib3",
                 "idna", "certifi", "charset-normalizer"),
    "norfair": ("norfair",),
    "cmaes": ("cmaes",),
    # pip takes PyTorch's own wheel for CPUs (2.13.0+cpu) where it finds it (its option find-links). The wheel of PyPI
    # for Linux needs NVIDIA's libraries, which are not among these.
    "stable-baselines3": ("stable-baselines3", "torch==2.13.0", "sympy", "mpmath"),
    "stonesoup": ("stonesoup", "ordered-set", "rtree", "ruamel.yaml", "pymap3d", "utm"),
}  # fmt: skip
OF_TRACKERS = "roboflow", "norfair", "stonesoup"
DEFAULT = Path.home() / ".cache" / "flockscope" / "peers"


def make_environments(folder: Path, libraries: Iterable[str] = OF_TRACKERS) -> dict[str, str]:
    """Installs what is not there yet and puts it at the end of the search path of modules.

    Returns the name and version of each library, "" for one that pip cannot install; pip's reason goes to stderr.
    """
    found = {}
    for library in libraries:
        packages = PACKAGES[library]
        place = folder / library
        if not place.is_dir():
            made = folder / f"{library}.unfinished"
            shutil.rmtree(made, ignore_errors=True)
            line = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--target", str(made), *packages]
            if subprocess.run(line, stdout=subprocess.DEVNULL, check=False).returncode:
                found[library] = ""
                continue
            made.rename(place)
        sys.path.append(str(place))
        versions = {one.name.lower().replace("_", "-"): one.version for one in distributions(path=[str(place)])}
        found[library] = f"{packages[0]} {versions[packages[0]]}"
    return found
