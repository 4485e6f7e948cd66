"""Splits whose forces follow from linear equations, for worst cases and derivatives.

The split "elastic" at the displaced geometry is not among them: "elastic" here means its limit of small
displacements, "elastic_linear", and results have that name. :meth:`exo_pin.ShoulderExo.elastic_difference` gives the
difference of the two in a pose.
"""

from __future__ import annotations

from ..core.validation import as_choice
from ..reaction.splits.elastic import Elastic
from ..reaction.splits.elastic_linear import ElasticLinear
from ..reaction.splits.registry import SPLITS
from ..reaction.splits.split import Split

__all__ = ["LINEAR_NOTE", "linear_split"]

_SPLITS = {name: law for name, law in SPLITS.items() if law.is_linear}
_SPLITS[Elastic.name] = _SPLITS[ElasticLinear.name]

#: Note on results by the linear formula.
LINEAR_NOTE = (
    "By the elastic formula for small displacements; elastic_difference() says how far that is from the displaced "
    "geometry."
)


def linear_split(name: str) -> Split:
    """The split with a name, in its limit of small displacements.

    Raises
    ------
    UnknownName
        If there is no split of that name, or its forces are not linear.
    """
    return _SPLITS[as_choice("split", name, _SPLITS)]
