"""Refinements beside their start, of which none may be worse (python benchmarks/refinements.py).

Every preset with actuators, several seeds, 2,000 designs each on a coarse grid, all criteria that the data allow. The
share of the full grid is that of the result; a search that found nothing better returns its start.
"""

import argparse
import time

import exo_pin as ep
from exo_pin.workspace import lifting_poses
from exo_pin.workspace.optimisation.starting_designs import joints_and_variables

PRESETS = ("four-cables", "four-cables-worn", "four-linear-actuators", "three-linear-actuators", "four-muscle-cables",
           "four-linear-actuators-worn")  # fmt: skip
LIMITS = ep.Criteria(largest_shoulder_force=150.0)


def refined(name, seed, budget):
    """The result of a refinement."""
    exo = ep.load(name)
    bounds, poses = joints_and_variables(exo.mechanism, {}, refine=True), lifting_poses(counts=(4, 4, 3))
    return ep.optimise(
        exo,
        bounds,
        poses,
        constraints=LIMITS,
        seed=seed,
        budget=budget,
        run_length=budget,
        refine=True,
        finer_step=20.0,
    )


def main():
    """Print a row a preset."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--budget", type=int, default=2000)
    options = parser.parse_args()
    print("| preset | start | results, seed by seed | worse | s |\n| --- | --- | --- | --- | --- |")
    for name in PRESETS:
        begun = time.perf_counter()
        found = [refined(name, seed, options.budget) for seed in range(1, options.seeds + 1)]
        shares, start = [each.best_candidate.index for each in found], found[0].start.index
        worse, took = sum(share < start for share in shares), time.perf_counter() - begun
        row = ", ".join(f"{100 * share:.1f}" for share in shares)
        print(f"| `{name}` | {100 * start:.1f} % | {row} % | {worse} of {len(shares)} | {took:.0f} |", flush=True)


if __name__ == "__main__":
    main()
