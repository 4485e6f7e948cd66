"""The device that a robot is: a wrist, a wrist with more than its record can hold, or any other."""

from __future__ import annotations

from os import PathLike

from ...chain import ClosedChain
from ...core.conventions import Side
from ...core.errors import NotAWrist
from ...device.files.device_files import read_device
from ...wrist_chain import wrist_of
from ..shoulder_exo import ShoulderExo
from .chain_exo import ChainExo
from .heavy_wrist import HeavyWrist


def exo_of_robot(
    chain: ClosedChain, side: Side, urdf: str | PathLike[str] | None, device_file: str | PathLike[str] | None
) -> ShoulderExo:
    """See :meth:`exo_pin.ShoulderExo.from_chain`, which asks this function."""
    if device_file is not None:
        return ChainExo(read_device(device_file, chain, side), urdf)
    try:
        found = wrist_of(chain, side)
    except NotAWrist:
        return ChainExo.of_robot(chain, side, urdf)
    if found.beyond_record:
        return HeavyWrist.of_recognised(chain, found, side, urdf)
    exo = ShoulderExo.from_mechanism(found.mechanism)
    exo._given_chain, exo.urdf = chain, urdf
    return exo


ShoulderExo._exo_of_robot = staticmethod(exo_of_robot)
