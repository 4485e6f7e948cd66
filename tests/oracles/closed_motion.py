"""Every mechanism of the tests, in random closed motion."""

from functools import cache

import numpy as np
import pinocchio as pin
from mechanisms import Named, five_bar, four_bar, parallelogram, planar_3rrr, random_loop, random_wrist
from numpy.polynomial import Polynomial
from spatial_mechanisms import agile_eye, delta, stewart

from exo_pin.chain import TYPES, ClosedChain
from exo_pin.design import preset
from exo_pin.wrist_chain import AssumedMasses, mechanism_urdf

KINDS = [kind for kind in TYPES if kind != "point"]


def wrist(mechanism, part="whole"):
    """A wrist with masses everywhere, as a simulator needs them."""
    urdf, closures = mechanism_urdf(mechanism, part, AssumedMasses())
    chain = ClosedChain.from_urdf(urdf, closures)
    return Named(urdf, closures, chain.close(chain.neutral()))


MAKERS = {
    "four_bar": four_bar,
    "four_bar_link": lambda: four_bar("link"),
    "five_bar": five_bar,
    "3rrr": planar_3rrr,
    "agile_eye": agile_eye,
    "delta": delta,
    "delta-universal": lambda: delta("universal"),
    "delta-rigid": lambda: delta("rigid"),
    "stewart": stewart,
    "parallelogram": parallelogram,
    "prototype": lambda: wrist(preset("prototype")),
    "prototype-floating": lambda: wrist(preset("prototype"), "floating"),
    "prototype-wrist": lambda: wrist(preset("prototype"), "wrist"),
    "heavy limbs": lambda: wrist(random_wrist(21, "UUU", with_masses=True)),
    "wrist alone": lambda: wrist(random_wrist(21, "UUU", with_masses=True), "wrist"),
    "mixed": lambda: wrist(random_wrist(22, "USUSU", with_masses=True)),
    "mixed-floating": lambda: wrist(random_wrist(22, "USUSU", with_masses=True), "floating"),
} | {f"loop-{kind}": lambda kind=kind: random_loop(kind) for kind in KINDS}


@cache
def named(name):
    return MAKERS[name]()


def closed_motion(name, seed, spread=0.2):
    """A fresh chain with q, v, a that keep its loops closed, not small."""
    rng = np.random.default_rng(seed)
    chain = named(name).chain()
    start = pin.integrate(chain.model, named(name).q, rng.uniform(-spread, spread, chain.model.nv))
    q = chain.close(start)
    v = chain.project_velocity(q, rng.normal(size=chain.model.nv) * 2)
    a = chain.project_acceleration(q, v, rng.normal(size=chain.model.nv) * 10)
    return chain, q, v, a


def loops(chain):
    """The closures that join bodies: all but couplings."""
    return [closure for closure in chain.closures if closure.type != "coupling"]


def coupled(chain, q, multipliers):
    """Generalised forces of the couplings, shape (nv,), from their polynomials."""
    found = np.zeros(chain.model.nv)
    for closure in chain.closures:
        if closure.type == "coupling":
            force = multipliers[chain.rows(closure.name)][0]
            found[chain.velocity_slice(closure.frame_b)] += force
            if closure.frame_a != "universe":
                x = q[chain.configuration_slice(closure.frame_a)][0] - closure.references[0]
                found[chain.velocity_slice(closure.frame_a)] -= Polynomial(closure.polynomial).deriv()(x) * force
    return found


def some_load(chain, seed):
    """Wrenches on two links."""
    rng = np.random.default_rng(seed)
    links = [frame.name for frame in chain.model.frames if frame.type == pin.FrameType.BODY and frame.parentJoint]
    chosen = rng.choice(links, 2, replace=False)
    return {str(link): rng.normal(size=6) * [20, 20, 20, 2, 2, 2] for link in chosen}
