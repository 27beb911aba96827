"""Golden truth hashes: one per scenario and environment, in tests/sim/golden.json; they guard `sim.hashing.ENGINE`.

    PYTHONPATH=. python benchmarks/golden.py            compare; exit code 1 where one is not as kept
    PYTHONPATH=. python benchmarks/golden.py --write    keep what is made now, for this environment

The last bits of a truth depend on CPU level, C library and versions (numpy, scipy, numba, LLVM, pymunk), so hashes are
kept by environment; elsewhere nothing is compared, and another environment adds its own by `--write`. A hash also bears
its scenario's: an edited scenario is told from a changed engine. `--write` refuses another truth of the same scenario
under the same ENGINE: raise the number first; all hashes of the old number then go.
"""

from __future__ import annotations

import argparse
import json
import platform
from importlib import metadata
from pathlib import Path
from typing import Any

from scenarios.loading.resolve import dump, load, names
from sim.hashing import ENGINE, scenario_hash, truth_hash
from sim.sequence import simulate
from sim.versions import cpu_level

FILE = Path(__file__).resolve().parents[1] / "tests" / "sim" / "golden.json"
LIBRARIES = ("numpy", "scipy", "numba", "llvmlite", "pymunk")
SEED = 40_000
WRITE = "PYTHONPATH=. python benchmarks/golden.py --write"


def environment() -> str:
    """What the last bits of a truth depend on."""
    libc = "-".join(platform.libc_ver()) or "unknown libc"
    versions = [f"{name} {metadata.version(name)}" for name in LIBRARIES]
    return ", ".join([platform.system(), cpu_level(), libc, *versions])


def kept() -> dict[str, Any]:
    """What the file holds; nothing where there is none."""
    empty = {"engine": ENGINE, "seed": SEED, "environments": {}}
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.is_file() else empty


def made(name: str) -> dict[str, str]:
    """Hashes of a scenario of the catalogue and of its truth, as they are now."""
    scenario = load(name)
    text = dump(scenario)
    return {
        "scenario": scenario_hash(text),
        "truth": truth_hash(text, SEED, 0, simulate(scenario, SEED, streams=()).truth),
    }


def difference(name: str, golden: dict[str, str] | None, now: dict[str, str]) -> str:
    """What is not as it was, and what to do; empty: nothing."""
    if golden is None:
        return f"{name}: no golden hash yet; {WRITE}"
    if golden["scenario"] != now["scenario"]:
        return f"{name}: the scenario has changed; {WRITE}"
    if golden["truth"] != now["truth"]:
        return f"{name}: the same scenario gives another truth; raise sim.hashing.ENGINE ({ENGINE}), then {WRITE}"
    return ""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="keep what is made now")
    args = parser.parse_args()
    file, here = kept(), environment()
    if file["engine"] != ENGINE:
        file = {"engine": ENGINE, "seed": SEED, "environments": {}}
    golden = file["environments"].get(here, {})
    now = {name: made(name) for name in names()}
    found = [text for name in now if (text := difference(name, golden.get(name), now[name]))]
    print(here, *(found or ["all as kept"]), sep="\n")
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
