"""What forces in a closed chain say of themselves: in words, and how sure they are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..kinematics.rank import rank_tolerance

if TYPE_CHECKING:
    from .reactions import ClosedForces

#: Forces are ill-conditioned where they are this many times the loads and a singular value this share of the largest.
_AMPLIFIED, _WEAK = 10.0, 1e-2


def forces_in_words(forces: ClosedForces) -> str:
    """Efforts line by line, and what is unique."""
    state, lines = forces.equations.state, list[str]()
    for name in list(state.model.names)[1:]:
        own = state.velocity_slice(name)
        units = np.where(state.topology.metres[own], "N", "N m")
        for value, unit, unique in zip(forces.tau[own], units, forces.effort_is_unique[own], strict=True):
            if value != 0.0 or not unique or name in state.roles.actuated:
                lines.append(f"effort of {name:24} {value:14.6f} {unit:4} {'unique' if unique else 'undetermined'}")
    held = f"not all unique (self-stresses: {forces.undetermined})" if forces.undetermined else "unique"
    lines.append(f"forces in joints and closures are {held}; joint_reaction(name) returns each")
    lines += [f"Caution: {text}" for text in forces.cautions]
    return "\n".join([*lines, f"equations of motion hold to {forces.residual:.1e} (N, N m)"])


def ill_conditioned(forces: ClosedForces, without_actuator: NDArray[np.int64] | None) -> tuple[str, ...]:
    """See :attr:`.ClosedForces.cautions`; the coordinates without actuator are all if None."""
    equations = forces.equations
    state, top = equations.state, equations.state.topology
    passive = np.arange(state.nv) if without_actuator is None else without_actuator
    efforts, loops = np.abs(forces.tau * top.column), np.abs(forces.multipliers / top.row_scale)
    load = max(equations.weights().max(initial=0.0), np.abs(equations.tau * top.column).max(initial=0.0))
    share = max(efforts.max(initial=0.0), loops.max(initial=0.0)) / load if load > 0.0 else 0.0
    if not share > _AMPLIFIED or not len(passive) or not forces.multipliers.size:
        return ()
    scaled = (equations.jacobian * top.row_scale[:, None] * top.column)[:, passive]
    values = np.linalg.svd(scaled, compute_uv=False)
    zero = rank_tolerance(scaled.shape, float(values[0]), state.model.njoints, equations.gap)
    least = float(values[values > zero].min(initial=values[0])) / float(values[0])
    if least > _WEAK:
        return ()
    effort = forces.tau[efforts.argmax()]
    worst = str(state.model.names[int(top.owners[efforts.argmax()])])
    return (
        f"the forces are ill-conditioned: the largest, with an effort of {effort:.4g} in {worst}, is {share:.0f} "
        "times the loads, because the loops hold one motion of the joints without actuator with "
        f"{least:.1e} of the strength of another (limit {_WEAK:g}); an error of 0.1 % in the geometry may change "
        f"these forces by up to about {min(0.1 / least, 100.0):.0f} %: move away from the singular configuration, "
        "or actuate a joint of this motion",
    )
