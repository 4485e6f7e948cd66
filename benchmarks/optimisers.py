"""Optimisers side by side on the search for four cables that hold an arm: CMA-ES, differential evolution, genetic, TPE.

::

    python benchmarks/optimisers.py [--evaluations 3000] [--seeds 2]

All make the same merit small (exo_pin.workspace.optimisation.merit, 24 variables, 272 poses) from the same budget of
designs; TPE gets a tenth of it, because its own time grows with the square of the number of trials. Besides
``.[optimise]`` it needs pymoo.
"""

import argparse
import time

import numpy as np
import optuna
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.problem import ElementwiseProblem
from pymoo.optimize import minimize

import exo_pin as ep
from exo_pin.core import compiled
from exo_pin.workspace import Criteria, free_joints, lifting_poses, starting_design
from exo_pin.workspace.optimisation.merit import Descent, Merit
from exo_pin.workspace.optimisation.search_poses import DesignVariables
from exo_pin.wrist import BodyShape

WEIGHTS = {"mean_shoulder_force": 0.05}


def problem():
    """Four cables that hold a man's arm."""
    arm = ep.Arm.from_anthropometry(1.75, 75, sex="male") + ep.load("prototype").arm
    start = starting_design(ep.Actuator("cable", pull_limit=400.0), arm, 4)
    criteria = Criteria(
        least_tension=5.0, largest_shoulder_force=120.0, body=BodyShape.of(ep.Wearer(1.75, 75, "male")), least_gap=0.003
    )
    return Merit(DesignVariables(start, free_joints(4)), lifting_poses(), criteria)


def cma_es(merit, seed, budget):
    """The package's own run."""
    run = Descent(merit, WEIGHTS, (seed, 0))
    run.run(budget)
    return run.value


def pymoo(algorithm):
    """A search by an algorithm of pymoo."""

    def search(merit, seed, budget):
        class Search(ElementwiseProblem):
            def __init__(self):
                super().__init__(n_var=merit.variables.count, n_obj=1, xl=0.0, xu=1.0)

            def _evaluate(self, x, out):
                out["F"] = merit.evaluate(x, WEIGHTS).merit

        return float(minimize(Search(), algorithm(), ("n_eval", budget), seed=seed).F[0])

    return search


def tpe(merit, seed, budget):
    """Optuna's default for few trials."""
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed, multivariate=True))
    names = [f"x{k}" for k in range(merit.variables.count)]
    study.optimize(
        lambda trial: merit.evaluate(np.array([trial.suggest_float(name, 0.0, 1.0) for name in names]), WEIGHTS).merit,
        n_trials=budget // 10,
    )
    return study.best_value


def main():
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--evaluations", type=int, default=3000)
    parser.add_argument("--seeds", type=int, default=2)
    options = parser.parse_args()
    merit = problem()
    searches = {
        "CMA-ES (cmaes)": cma_es,
        "differential evolution (pymoo)": pymoo(lambda: DE(pop_size=72)),
        "genetic (pymoo)": pymoo(lambda: GA(pop_size=72)),
        "TPE (Optuna), a tenth": tpe,
    }
    with compiled.mode("compiled"):
        merit.evaluate(np.full(merit.variables.count, 0.3), WEIGHTS)
        for name, search in searches.items():
            begun = time.process_time()
            values = [search(merit, seed, options.evaluations) for seed in range(options.seeds)]
            spent = (time.process_time() - begun) / options.seeds
            listed = ", ".join(f"{value:.3f}" for value in values)
            print(f"{name:<32} merit {listed}   {spent:.1f} s of CPU a run", flush=True)


if __name__ == "__main__":
    main()
