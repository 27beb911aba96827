"""`flockscope fit relational`: learns the speed table and the relations of `relational` from simulated truth."""

from __future__ import annotations

from tracking.app import option_parsing
from tracking.app.command_result import CommandResult
from tracking.app.fit_options import FitRelationalOptions


def fit_relational(options: FitRelationalOptions) -> CommandResult:
    """Writes the fitted parameters of `relational` as a TOML file; parameters that are not fitted have their defaults.

    The result's data: "file", and "params", the fitted values by name.

    Raises InputError if --out is no .toml file or cannot be written, if a name or seeds are wrong, or if the scenes
    have too few people or no groups. Raises WorkError if a script cannot be fulfilled or the disk is full.
    """
    import numpy as np

    from scenarios.loading.resolve import resolve
    from sim.io.files.atomic import write_file
    from tracking.fitting.grouping_scenes import simulated
    from tracking.fitting.relational import fit_relational as fit
    from tracking.papers.relational.config import RelationalConfig

    out = option_parsing.output_file(options.out, ".toml")
    entries = [entry for name in options.names for entry in resolve(name)]
    seeds = option_parsing.seeds(options.seeds)
    params = fit((simulated(entry, seed) for entry in entries for seed in seeds), RelationalConfig().speed_ends)
    config = RelationalConfig.from_dict(dict(params), out)
    write_file(out, config.to_toml().encode())
    width, body = max(map(len, params)), config.as_dict()
    lines = [
        f"{name:<{width}}  {np.round(np.array(body[name]), 4)}  {RelationalConfig.known(name).unit}" for name in params
    ]
    lines += ["", f"→ {out}: use it as --params {out}"]
    return CommandResult({"file": out, "params": params}, "\n".join(lines))
