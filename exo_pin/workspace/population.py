"""Workspaces of designs over persons: what each of a population gets from each design."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..core.errors import InvalidInput
from ..core.errors.checked import checked
from ..core.progress import mapped
from ..core.validation import require_method, require_type
from ..design import Wearer
from ..study import StudyTable
from .criteria import Criteria

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from ..exo.shoulder_exo import ShoulderExo

#: Tasks that are sent to a worker at once; each takes a tenth of a second or more.
_BLOCK = 2


@checked
def population(
    designs: Iterable[ShoulderExo],
    wearers: Sequence[Wearer],
    poses: Rotation | float | None = None,
    criteria: Criteria | Iterable[str] | None = None,
    *,
    moving_centre: bool = False,
    executor: Executor | None = None,
    progress: bool = False,
) -> StudyTable:
    """The workspace of every design on every person.

    Parameters
    ----------
    designs : iterable of ShoulderExo
        Each is worn by everybody (:meth:`exo_pin.ShoulderExo.worn_by`).
    wearers : sequence of Wearer
        The persons.
    poses, criteria
        As in :meth:`exo_pin.ShoulderExo.workspace`.
    moving_centre : bool
        Whether the shoulder's centre moves with the arm, for each by the path of their own (needs the extra
        ``person``).
    executor : concurrent.futures.Executor, optional
        Where they are computed (docs/howto/many_machines.md); here if left out. The numbers are the same.
    progress : bool
        Whether to show a progress bar.

    Returns
    -------
    StudyTable
        A row a design and person, designs one after the other: ``design``, ``height_m``, ``mass_kg``, ``sex``,
        ``index`` (Φ of (C-1), the share of the poses inside), ``limited_by`` (the criterion that alone costs most;
        "" where none does), ``mean_F_s_N`` and ``peak_F_s_N`` inside, NaN where they are not known.

    Raises
    ------
    InvalidInput
        If there is no design or no person, or the executor does not return one result a design and person.
    MissingData, UnknownName, MissingExtra
        As :meth:`exo_pin.ShoulderExo.workspace` raises them.

    Examples
    --------
    >>> from exo_pin.workspace import population
    >>> table = population([ep.load("four-linear-actuators-worn")], ep.Wearer.drawn(2), 20.0)
    >>> table["index"].round(2).tolist()  # share of the daily poses, one a person
    [0.88, 0.88]
    """
    exos, limits = list(designs), Criteria.of(criteria)
    if not exos or not wearers:
        raise InvalidInput(f"expected designs and wearers, got {len(exos)} and {len(wearers)}")
    for exo in exos:
        require_method("designs", exo, "workspace", "ShoulderExos")
    for wearer in wearers:
        require_type("wearers", wearer, Wearer, "Wearers")
    question = functools.partial(_row, poses=poses, criteria=limits, moving_centre=moving_centre)
    tasks = [(exo, wearer) for exo in exos for wearer in wearers]
    return StudyTable(mapped(question, tasks, executor, "persons", progress, _BLOCK))


def _row(
    task: tuple[ShoulderExo, Wearer], poses: Rotation | float | None, criteria: Criteria, moving_centre: bool
) -> dict[str, Any]:
    exo, wearer = task
    path = None
    if moving_centre:
        from ..person import Person  # here: it needs an extra

        person = Person(wearer.height, wearer.mass, wearer.sex, elbow_flexion=wearer.elbow_flexion, side=exo.side)
        path = person.centre_path()
    found = exo.worn_by(wearer).workspace(poses, criteria, centre_offset=path)
    lost = found.lost_to
    worst = max(lost, key=lambda name: lost[name], default="")
    return {
        "design": exo.name,
        "height_m": wearer.height,
        "mass_kg": wearer.mass,
        "sex": wearer.sex,
        "index": found.index,
        "limited_by": worst if worst and lost[worst] > 0.0 else "",
        "mean_F_s_N": found.force_inside.get("mean", np.nan),
        "peak_F_s_N": found.force_inside.get("largest", np.nan),
    }
