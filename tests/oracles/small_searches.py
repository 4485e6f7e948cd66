"""A search that takes a tenth of a second: two variables of three cables, over three poses, checked on coarse grids."""

import exo_pin as ep
from exo_pin.workspace import Criteria, starting_design

ARM = ep.Arm.from_anthropometry(1.75, 75, sex="male")
EXO = ep.ShoulderExo.from_mechanism(starting_design(ep.Actuator("cable", pull_limit=400.0), ARM, 3))
BOUNDS = {"A[1].radius": (0.1, 0.3), "A[2].elevation": (-1.0, 1.0)}
GENERATION, RUN = 24, 48


def searched(storage=None, **changes):
    """What is found, by default in one run of two generations."""
    given = {
        "variables": BOUNDS, "poses": EXO.pose([0.0, 40.0, 80.0]), "constraints": Criteria(names=("singularity",)),
        "budget": RUN, "run_length": RUN, "fit_strokes": False, "step": 90.0, "finer_step": 90.0,
    }  # fmt: skip
    return ep.optimise(changes.pop("exo", EXO), storage=storage, **(given | changes))
