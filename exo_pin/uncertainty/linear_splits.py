"""Splits whose forces follow from linear equations, as worst cases and derivatives need them.

The split "elastic" at the displaced geometry is not among them: "elastic" stands here for its limit of small
displacements, "elastic_linear", and results carry that name. How far the two are apart in a pose says
:meth:`exo_pin.ShoulderExo.elastic_difference`.
"""

from __future__ import annotations

from ..core.errors import UnknownName
from ..reaction.splits.elastic import Elastic
from ..reaction.splits.elastic_linear import ElasticLinear
from ..reaction.splits.registry import SPLITS
from ..reaction.splits.split import Split

__all__ = ["LINEAR_NOTE", "linear_split"]

_SPLITS = {name: law for name, law in SPLITS.items() if law.is_linear}
_SPLITS[Elastic.name] = _SPLITS[ElasticLinear.name]

#: What a result by the linear formula says of itself.
LINEAR_NOTE = (
    "By the elastic formula for small displacements; elastic_difference() says how far that is from the displaced "
    "geometry."
)


def linear_split(name: str) -> Split:
    """The split of a name, in its limit of small displacements.

    Raises
    ------
    UnknownName
        If there is none of that name, or its forces are not linear.
    """
    if name not in _SPLITS:
        raise UnknownName("split", name, _SPLITS)
    return _SPLITS[name]
