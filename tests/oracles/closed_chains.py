"""Chains with a closed configuration, and configurations away from it."""

import numpy as np
import pinocchio as pin
from mechanisms import five_bar, four_bar, parallelogram, planar_3rrr, random_loop
from spatial_mechanisms import agile_eye, delta, stewart

from exo_pin import thesis_rotation
from exo_pin.chain import TYPES, ClosedChain
from exo_pin.design import preset
from exo_pin.wrist_chain import mechanism_urdf

NAMED = {
    "four_bar": four_bar(),
    "four_bar_link": four_bar("link"),
    "five_bar": five_bar(),
    "3rrr": planar_3rrr(),
    "agile_eye": agile_eye(),
    "delta": delta(),
    "delta-universal": delta("universal"),
    "delta-rigid": delta("rigid"),
    "stewart": stewart(),
    "parallelogram": parallelogram(),
} | {f"loop-{kind}": random_loop(kind) for kind in TYPES if kind != "point"}


def wrist(part):
    chain = ClosedChain.from_urdf(*mechanism_urdf(preset("prototype"), part))
    q = chain.neutral()
    root = chain.configuration_slice("root_joint")
    q[root.stop - 4 : root.stop] = thesis_rotation(40, -20, -30, degrees=True).as_quat()
    return chain, chain.close(q, hold=["root_joint"])


CHAINS = {name: (named.chain(), named.q) for name, named in NAMED.items()} | {
    f"wrist-{part}": wrist(part) for part in ("whole", "wrist", "floating")
}


def off(chain, q, rng, size, hold=()):
    """q with every free coordinate off by up to size, rad and characteristic lengths."""
    away = rng.uniform(-size, size, chain.model.nv) * np.where(
        chain._state.topology.metres, chain.characteristic_length, 1.0
    )
    away[chain.velocity_indices(hold)] = 0.0
    return pin.integrate(chain.model, q, away)
