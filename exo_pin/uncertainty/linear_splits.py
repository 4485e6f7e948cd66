"""Splits whose forces follow from linear equations, for worst cases and derivatives.

The split "elastic" at the displaced geometry is not among them: "elastic" here means its limit of small
displacements, "elastic_linear", and results have that name. :meth:`exo_pin.ShoulderExo.elastic_difference` gives the
difference of the two in a pose.
"""

from __future__ import annotations

from ..core.errors import InvalidInput
from ..reaction.assumptions import as_split
from ..reaction.splits.elastic import Elastic
from ..reaction.splits.elastic_linear import ElasticLinear
from ..reaction.splits.spherical import Spherical
from ..reaction.splits.split import Split

__all__ = ["LINEAR_NOTE", "linear_split"]

#: Note on results by the linear formula.
LINEAR_NOTE = (
    "By the elastic formula for small displacements; elastic_difference() says how far that is from the displaced "
    "geometry."
)


def linear_split(split: str | Split) -> Split:
    """The split, in its limit of small displacements.

    Raises
    ------
    InvalidInput
        If its equations are other ones than g = 0, or side forces by stiffness; UnknownName, its child, if there is no
        split of that name.
    """
    law = as_split(split)
    if type(law) is Elastic and not law.locked:
        return ElasticLinear()
    if type(law) in (Spherical, ElasticLinear):
        return law
    raise InvalidInput(
        f'derivatives and worst cases are of the equations of "{Spherical.name}" and "{Elastic.name}", and split '
        f"{law.name!r} has others: ask one of these, or compare its reactions in the poses and offsets that matter"
    )
