"""``exo-pin mobility`` and ``exo-pin forces`` of any robot: its freedoms, and the forces in actuators and joints."""

from __future__ import annotations

import argparse

import numpy as np

from ..chain import PULL, ClosedChain
from . import deliver
from .options.configuration_options import configuration
from .options.option_values import named_numbers
from .options.outputs import joined_json
from .options.query_options import design


def run_mobility(options: argparse.Namespace) -> int:
    """Answer ``exo-pin mobility`` and return its exit status."""
    exo = design(options)
    chain, q = exo.chain, configuration(options, exo)
    answer = chain.mobility(q, frame=options.frame, part=options.part or "pose")
    print(f"{exo.name}\n{answer}")
    beyond = chain.beyond_limits(q)
    if beyond:
        print(f"beyond their limits  {', '.join(beyond)}")
    for text in chain.description.left_out:
        print(f"left out             {text}")
    return 0


def run_forces(options: argparse.Namespace) -> int:
    """Answer ``exo-pin forces`` and return its exit status."""
    exo = design(options)
    chain = exo.chain
    actuated = chain.roles.actuated if options.actuated is None else tuple(options.actuated.split(","))
    forces = chain.inverse_dynamics(
        configuration(options, exo),
        external=_wrenches(options.external),
        actuated=actuated,
        effort_bounds=dict.fromkeys(actuated, PULL) if options.pull else None,
        objective=None if options.least is None else {options.least: [1.0] * 3 + [0.0] * 3},
    )
    names = options.joint or _default_joints(chain)
    reactions = [forces.joint_reaction(name, at=options.at, in_frame=options.in_frame) for name in names]
    lines = [exo.name, *(f"Caution: {text}" for text in forces.cautions)]
    lines += [f"Left out: {text}" for text in chain.description.left_out]
    slides = False
    for joint in actuated:
        own = chain.velocity_slice(joint)
        rows = zip(forces.effort(joint), forces.effort_is_unique[own], forces.effort_interval(joint), strict=True)
        for (value, alone, (low, high)), slide in zip(rows, chain.metres[own], strict=True):
            slides |= bool(slide)
            reach = "can be any number" if np.isinf([low, high]).all() else f"from {low:.6g} to {high:.6g}"
            range_text = "unique" if alone else f"undetermined, {reach}"
            lines.append(f"effort of {joint:24} {value + 0.0:14.6f} {'N' if slide else 'N m':4} {range_text}")
    if slides:
        lines.append("A slide's effort is positive where it pushes: the tension of a limb is its negative.")
    text = "\n".join([*lines, *(f"\n{reaction}" for reaction in reactions)])
    efforts = {joint: {"value": forces.effort(joint), "interval": forces.effort_interval(joint)} for joint in actuated}
    joints = {each.name: each for each in reactions}
    deliver(
        options,
        text,
        json=lambda: joined_json(exo, forces=forces, efforts=efforts, reactions=joints, cautions=forces.cautions),
    )
    return 0


def _default_joints(chain: ClosedChain) -> list[str]:
    """The shoulder where there is one, else the closures that transmit a wrench."""
    if chain.roles.shoulder is not None:
        return [chain.roles.shoulder]
    return [closure.name for closure in chain.closures if not closure.kind.is_coupling]


def _wrenches(texts: list[str]) -> dict[str, np.ndarray]:
    """Wrenches by frame; several on one frame add up."""
    total: dict[str, np.ndarray] = {}
    for text in texts:
        expected = "--external FRAME=FX,FY,FZ or with ,MX,MY,MZ behind"
        frame, values = named_numbers(text, expected, 3, 6, finite=True)
        total[frame] = total.get(frame, np.zeros(6)) + np.append(values, np.zeros(6 - len(values)))
    return total
