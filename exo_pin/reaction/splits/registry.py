"""The splits by name."""

from __future__ import annotations

from ...core.errors import InvalidInput
from ...core.validation import as_choice
from .elastic import Elastic
from .elastic_linear import ElasticLinear
from .minimal import Minimal
from .spherical import Spherical
from .split import Split
from .standalone import Standalone

__all__ = ["SPLITS", "as_split", "check_option"]

_ALL = (Spherical(), Minimal(), Elastic(), ElasticLinear(), Elastic("locked"), Standalone())
#: Splits that come with the package. The first is the default.
SPLITS: dict[str, Split] = {split.name: split for split in _ALL}


def as_split(split: str | Split) -> Split:
    """The split of a name, or an instance of a class of one's own.

    Raises
    ------
    InvalidInput
        If there is none of that name.
    """
    return split if isinstance(split, Split) else SPLITS[as_choice("split", split, tuple(SPLITS))]


def check_option(split: Split, option: str) -> None:
    """Refuse an option that a split cannot follow.

    Raises
    ------
    InvalidInput
        Saying why, or which splits can.
    """
    if option in split.options:
        return
    if option in split.refusals:
        raise InvalidInput(split.refusals[option])
    names = [f'split="{other.name}"' for other in SPLITS.values() if option in other.options]
    raise InvalidInput(f"{option} belong to {' or '.join(names)}, got split={split.name!r}")
