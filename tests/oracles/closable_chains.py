"""Named chains with a configuration to start from, and configurations around it with open loops."""

import numpy as np
import pinocchio as pin
from mechanisms import five_bar, four_bar, parallelogram, planar_3rrr, random_loop, random_wrist
from spatial_mechanisms import agile_eye, delta, stewart

from exo_pin import thesis_rotation
from exo_pin.chain import TYPES, ClosedChain
from exo_pin.design import preset
from exo_pin.wrist_chain import mechanism_urdf

OTHERS = (
    planar_3rrr(),
    agile_eye(),
    delta(),
    delta("universal"),
    delta("rigid"),
    stewart(),
    parallelogram(),
)


def chains():
    for named in OTHERS:
        yield named.closures.name, named.chain()
    yield "four_bar", four_bar().chain()
    yield "four_bar_link", four_bar("link").chain()
    yield "five_bar", five_bar().chain()
    for part in ("whole", "wrist", "floating"):
        yield f"prototype-{part}", ClosedChain.from_urdf(*mechanism_urdf(preset("prototype"), part))
    for kind in TYPES:
        if kind != "point":
            yield f"loop-{kind}", random_loop(kind).chain()
    yield "mixed", ClosedChain.from_urdf(*mechanism_urdf(random_wrist(7, "USUSU")))


CHAINS = dict(chains())


def posed(chain):
    """The prototype away from its rest, which is close to singular."""
    q = chain.neutral()
    root = chain.configuration_slice("root_joint")
    q[root.stop - 4 : root.stop] = thesis_rotation(40, -20, -30, degrees=True).as_quat()
    return chain.close(q, hold=["root_joint"])


HAND = {"four_bar": four_bar().q, "four_bar_link": four_bar("link").q, "five_bar": five_bar().q}


HAND |= {f"loop-{kind}": random_loop(kind).q for kind in TYPES if kind != "point"}


HAND |= {named.closures.name: named.q for named in OTHERS}


START = HAND | {name: posed(chain) for name, chain in CHAINS.items() if name.startswith("prototype")}


def open_configurations(chain, seed, count=5, size=0.3):
    rng = np.random.default_rng(seed)
    start = START.get(chain.description.name, chain.neutral())
    return [pin.integrate(chain.model, start, rng.uniform(-size, size, chain.model.nv)) for _ in range(count)]
