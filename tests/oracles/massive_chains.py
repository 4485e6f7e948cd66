"""Named chains whose links all have mass, as simulators need them."""

from closed_chains import CHAINS

from exo_pin.chain import ClosedChain
from exo_pin.design import preset
from exo_pin.wrist_chain import AssumedMasses, mechanism_urdf

HEAVY = {
    part: ClosedChain.from_urdf(*mechanism_urdf(preset("prototype"), part, AssumedMasses()))
    for part in ("whole", "wrist", "floating")
}

MASSIVE = {name: case for name, case in CHAINS.items() if not name.startswith("wrist")} | {
    f"wrist-{part}": (chain, chain.close(chain.neutral())) for part, chain in HEAVY.items()
}
