"""Golden truth hashes, one per scenario and environment, in tests/sim/golden.json; they guard `sim.hashing.ENGINE`.

    python -m benchmarks.golden            compare; exit code 1 if a hash differs from the file's, or is missing
    python -m benchmarks.golden --write    write the present hashes of this environment into the file

The last bits of a truth depend on CPU level, C library and versions (numpy, scipy, numba, LLVM, pymunk). Therefore
hashes are kept per environment: in a new environment --write adds its hashes. Each hash of a truth is kept beside that
of its scenario, so that an edited scenario can be told from a changed engine. --write refuses a different truth of
the same scenario under the same ENGINE: raise the number first. All hashes of the old number are then dropped.
"""

from __future__ import annotations

import json
import platform
from importlib import metadata
from pathlib import Path
from typing import Any

from benchmarks.support.options import new_parser
from scenarios.loading.resolve import dump, load, names
from sim.hashing import ENGINE, scenario_hash, truth_hash
from sim.sequence import simulate
from sim.versions import cpu_level

FILE = Path(__file__).resolve().parents[1] / "tests" / "sim" / "golden.json"
LIBRARIES = ("numpy", "scipy", "numba", "llvmlite", "pymunk")
SEED = 40_000
WRITE = "python -m benchmarks.golden --write"
Hashes = dict[str, str]


def environment() -> str:
    """Returns what the last bits of a truth depend on, as one text."""
    libc = "-".join(platform.libc_ver()) or "unknown libc"
    versions = [f"{name} {metadata.version(name)}" for name in LIBRARIES]
    return ", ".join([platform.system(), cpu_level(), libc, *versions])


def golden_file() -> dict[str, Any]:
    """Returns the content of the file; without a file, the same keys without hashes."""
    empty = {"engine": ENGINE, "seed": SEED, "environments": {}}
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.is_file() else empty


def present_hashes(name: str) -> Hashes:
    """Returns the hashes of a scenario of the catalogue and of its truth, by "scenario" and "truth"."""
    scenario = load(name)
    text = dump(scenario)
    return {
        "scenario": scenario_hash(text),
        "truth": truth_hash(text, SEED, 0, simulate(scenario, SEED, streams=()).truth),
    }


def difference(name: str, golden: Hashes | None, now: Hashes) -> str:
    """Returns how the present hashes of a scenario differ from the golden ones and what to do; "" if they are equal."""
    if golden is None:
        return f"{name}: no golden hash yet; {WRITE}"
    if golden["scenario"] != now["scenario"]:
        return f"{name}: the scenario has changed; {WRITE}"
    if golden["truth"] != now["truth"]:
        return f"{name}: the same scenario gives another truth; raise sim.hashing.ENGINE ({ENGINE}), then {WRITE}"
    return ""


def main() -> int:
    parser = new_parser(__doc__)
    parser.add_argument("--write", action="store_true", help="write the present hashes of this environment")
    args = parser.parse_args()
    file, here = golden_file(), environment()
    if file["engine"] != ENGINE:
        file = {"engine": ENGINE, "seed": SEED, "environments": {}}
    golden = file["environments"].get(here, {})
    now = {name: present_hashes(name) for name in names()}
    found = [text for name in now if (text := difference(name, golden.get(name), now[name]))]
    print(here, *(found or ["all hashes equal the golden ones"]), sep="\n")
    if not args.write:
        return 1 if found else 0
    if any("ENGINE" in text for text in found):
        print("nothing written")
        return 1
    file["environments"][here] = now
    file["environments"] = dict(sorted(file["environments"].items()))
    FILE.write_text(json.dumps(file, indent=1) + "\n", encoding="utf-8")
    print(f"{FILE}: {len(now)} scenarios")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
