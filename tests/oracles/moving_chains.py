"""Every named mechanism as a chain in a seeded motion that keeps its loops closed."""

from typing import NamedTuple

import mechanisms
import numpy as np
import pinocchio as pin
import spatial_mechanisms

from exo_pin.chain import ClosedChain
from exo_pin.design import preset
from exo_pin.wrist_chain import mechanism_urdf

LOOPS = ("rigid", "spherical", "revolute", "universal", "prismatic", "cylindrical", "distance", "coupling")

#: Chains whose links all have mass.
WITH_MASS = {
    "four-bar": mechanisms.four_bar,
    "four-bar cut in a link": lambda: mechanisms.four_bar("link"),
    "five-bar": mechanisms.five_bar,
    "3RRR": mechanisms.planar_3rrr,
    "agile eye": spatial_mechanisms.agile_eye,
    "delta with rods": lambda: spatial_mechanisms.delta("rods"),
    "delta with universal joints": lambda: spatial_mechanisms.delta("universal"),
    "delta with rigid closures": lambda: spatial_mechanisms.delta("rigid"),
    "Stewart platform": spatial_mechanisms.stewart,
    "parallelogram": mechanisms.parallelogram,
    **{f"{kind} loop": lambda kind=kind: mechanisms.random_loop(kind) for kind in LOOPS},
    "heavy wrist": lambda: mechanisms.random_wrist(21, "UUU", with_masses=True),
    "heavy wrist of both kinds of limbs": lambda: mechanisms.random_wrist(22, "USUSU", with_masses=True),
}
ALL = {**WITH_MASS, "prototype": lambda: preset("prototype")}


class Moving(NamedTuple):
    """A chain, joints whose coordinates are independent, and a motion."""

    chain: ClosedChain
    independent: list[str]
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray

    @property
    def dof(self) -> int:
        return len(self.chain.velocity_indices(self.independent))


def moving(name: str, seed: int = 0) -> Moving:
    """The mechanism of that name in ``ALL``, near its known configuration."""
    rng = np.random.default_rng(seed)
    made = ALL[name]()
    if isinstance(made, mechanisms.Named):
        chain, start = made.chain(), made.q
    else:
        chain = ClosedChain.from_urdf(*mechanism_urdf(made, part="whole"))
        start = chain.neutral()
    away = pin.integrate(chain.model, start, rng.uniform(-0.1, 0.1, chain.model.nv))
    q = chain.close(away)
    known = {"Stewart platform": ["flight"]}
    if chain.roles.shoulder == "root_joint":
        independent = ["root_joint"]
    elif name in known:
        independent = known[name]
    elif name.endswith("loop"):
        first = {chain.velocity_slice(joint).start: joint for joint in list(chain.model.names)[1:]}
        independent = [first[k] for k in chain.split(q).independent]
    else:
        independent = list(chain.roles.actuated)
    dof = len(chain.velocity_indices(independent))
    velocity, acceleration = rng.normal(size=(2, dof))
    return Moving(chain, independent, q, *chain.dependent_motion(q, independent, velocity, acceleration))


def drivers(case: Moving) -> list[str]:
    """Joints that can drive the chain: a wrist's slides, otherwise the independent joints."""
    return list(case.chain.roles.actuated) if "root_joint" in case.independent else case.independent
