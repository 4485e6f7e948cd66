"""What a chain answers to questions of forces, motion in time and their changes, and such chains."""

import re
from dataclasses import replace

import numpy as np
import pinocchio as pin
from asked_chains import all_tried, of_forces, of_reaction, short
from moving_chains import drivers, moving

from exo_pin.chain import ClosedChain, JointProperties

#: Efforts and reactions with no bound below or above.
NONE = (-np.inf, np.inf)


def loaded(name, friction=0.0, seed=3, even=False):
    """A mechanism in motion, its joints with springs, dampers, armatures, limits of effort and friction.

    ``even``: as files can say it, the same in both directions and in hinges and slides alone, with limits of position.
    """
    case, rng = moving(name, seed), np.random.default_rng(seed + 1)
    model, joints = case.chain.model.copy(), []
    model.damping, model.armature = rng.uniform(0.1, 0.9, model.nv), rng.uniform(0.01, 0.09, model.nv)
    model.upperEffortLimit = rng.uniform(20.0, 60.0, model.nv)
    model.lowerEffortLimit = -rng.uniform(20.0, 60.0, model.nv)
    model.gravity.linear = np.array([1.3, -2.1, -9.2])
    model.upperDryFrictionLimit = friction * rng.uniform(0.5, 1.5, model.nv)
    model.lowerDryFrictionLimit = -friction * rng.uniform(0.5, 1.5, model.nv)
    if even:
        model.lowerEffortLimit = -model.upperEffortLimit
        model.lowerDryFrictionLimit = -model.upperDryFrictionLimit
    for k in range(1, model.njoints):
        own = slice(model.idx_vs[k], model.idx_vs[k] + model.nvs[k])
        if even and model.nvs[k] > 1:
            for values in (model.damping, model.armature, model.upperDryFrictionLimit, model.lowerDryFrictionLimit):
                values[own] = 0.0
            model.upperEffortLimit[own], model.lowerEffortLimit[own] = np.inf, -np.inf
            continue
        if even:
            at = model.idx_qs[k]
            model.lowerPositionLimit[at], model.upperPositionLimit[at] = case.q[at] - 0.4, case.q[at] + 0.3
        if model.nqs[k] == 1:
            joints.append(JointProperties(model.names[k], float(rng.uniform(2.0, 9.0)), (float(rng.normal()),)))
        elif model.nqs[k] == 4:
            joints.append(JointProperties(model.names[k], float(rng.uniform(2.0, 9.0))))
    chain = ClosedChain(model, replace(case.chain.description, joints=tuple(joints)))
    return case._replace(chain=chain)


def pushed(chain, seed=8):
    """Wrenches on two bodies."""
    rng, names = np.random.default_rng(seed), [each.name for each in chain.model.frames if each.parentJoint]
    return {names[0]: 3.0 * rng.normal(size=6), names[-1]: 2.0 * rng.normal(size=6)}


def forces_of(case):
    """Forces that make a motion, under loads, bounds and objectives, and what is refused."""
    chain, q, v, a, joints = case.chain, case.q, case.v, case.a, drivers(case)
    names, external = list(chain.model.names)[1:], pushed(case.chain)
    parts, more = [*names[1:2], *(each.name for each in chain.closures[:1])], {"external": external}
    every = dict(more, actuated=names)
    wide = dict.fromkeys(joints, (-30.0, 25.0))
    rows = np.stack([q, q, pin.integrate(chain.model, q, 0.2 + 0.0 * v)])

    def bound(**problem):
        return of_forces(chain.inverse_dynamics(q, v, a, **more, **problem), False)

    def stack(**problem):
        found = chain.inverse_dynamics(rows, np.stack([v, 0.0 * v, v]), a, **problem)
        reactions = [of_reaction(found.joint_reaction(name, in_frame="local")) for name in parts[:1]]
        whole = of_reaction(found.wrench_on(list(chain.placements(q))[-1]))
        said = [short(str(found)), found.tau, found.friction, found.multipliers, found.undetermined, found.status]
        said += [found.effort_is_unique, [[k, type(error).__name__] for k, error in found.failures.items()]]
        return [[*said, found.q, found.v, found.a, found.effort(names[0]), reactions, whole]]

    return all_tried(
        least=lambda: of_forces(chain.inverse_dynamics(q, v, a, actuated=joints, **more)),
        still=lambda: of_forces(chain.inverse_dynamics(q, actuated=joints), False),
        every=lambda: of_forces(chain.inverse_dynamics(q, v, a, **every, effort_bounds="model")),
        closures=lambda: bound(actuated=names, metric="closures"),
        efforts=lambda: bound(actuated=names, objective="efforts"),
        weighed=lambda: bound(actuated=names, objective=dict.fromkeys(parts, 2.0)),
        within=lambda: of_forces(
            chain.inverse_dynamics(
                q,
                v,
                a,
                **every,
                effort_bounds=wide,
                reaction_bounds={parts[0]: ([-60.0] * 3 + [-9.0] * 3, [70.0] * 3 + [8.0] * 3)},
            )
        ),
        too_weak=lambda: bound(actuated=joints, effort_bounds={joints[0]: (-1e-3, 1e-3)}),
        undriven=lambda: bound(actuated=joints[1:]),
        one=lambda: of_reaction(chain.joint_reaction(names[0], q, v, a, actuated=joints, on="universe")),
        stack=lambda: stack(actuated=joints, external=external),
        stack_within=lambda: stack(actuated=names, effort_bounds="model"),
        stack_closed=lambda: stack(actuated=joints, close=True),
        closed=lambda: [chain.inverse_dynamics(rows[2], v, a, actuated=joints, close=True).tau],
        weightless=lambda: bound(actuated=names, objective={}),
        opening=lambda: bound(actuated=None) and chain.inverse_dynamics(q, v + 0.1, a),
        opened=lambda: chain.inverse_dynamics(q, v, a + 0.1, actuated=joints),
        wrong=lambda: chain.inverse_dynamics(q, v, a, metric="efforts"),
        unknown=lambda: chain.inverse_dynamics(q, v, a, effort_bounds={"none": NONE}),
        crossed=lambda: chain.inverse_dynamics(q, v, a, actuated=names, effort_bounds={names[0]: (1.0, -1.0)}),
    )


def motion_of(case, stops=False):
    """Accelerations under efforts, their forces, and the motion in time."""
    chain, q, v, joints = case.chain, case.q, case.v, drivers(case)
    rng = np.random.default_rng(12)
    tau, external = 4.0 * rng.normal(size=chain.model.nv), pushed(chain)

    def under(v, **more):
        found = chain.forward_dynamics(q, v, tau, external=external, **more)
        sure = found.contact_is_unique
        rest = [np.where(sure, found.friction, 0.0), np.where(sure, found.stop_reactions, 0.0), sure]
        return [found.a, found.tau, rest, of_forces(found.forces)]

    def run(times, *given, **more):
        found = chain.simulate(q, v, times, *given, **more)
        events = [(each.kind, each.time, each.joints, each.order) for each in found.events]
        work = [found.energy, found.kinetic_energy, found.work, found.dissipated]
        return [found.q, found.v, work, bool(found.opening.max() < 1e-9), events]

    def later():
        own = ClosedChain(chain.model.copy(), chain.description)
        found = own.forward_dynamics(q, v, tau)
        own.model.gravity.linear = np.zeros(3)
        return of_forces(found.forces, False)

    times = np.array([0.1, 0.12, 0.15])
    return all_tried(
        moving=lambda: under(v),
        still=lambda: under(None),
        stops=lambda: under(0.0 * v, stops=True) if stops else None,
        by_joint=lambda: chain.forward_dynamics(q, v, {joints[0]: 2.0}).a,
        bare=lambda: chain.forward_dynamics(q).a,
        no_number=lambda: chain.forward_dynamics(q, v, np.nan * tau),
        later=later,
        without=lambda: chain.without_friction().forward_dynamics(q, v, tau).a,
        run=lambda: run(times, {joints[0]: 3.0}, external=external),
        driven=lambda: run(times, lambda t, q, v: tau * t - 0.2 * v, rtol=1e-7, atol=1e-8),
        opening=lambda: chain.forward_dynamics(q, v + 0.1),
        shape=lambda: chain.forward_dynamics(q, v, {joints[0]: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]}),
        backwards=lambda: chain.simulate(q, v, times[::-1]),
        bounce=lambda: chain.simulate(q, v, times, restitution=1.2),
        loose=lambda: chain.simulate(q, v, times, rtol=1.0),
    )


def changes_of(case):
    """Derivatives of forces and accelerations."""
    chain, q, v, a, joints = case.chain, case.q, case.v, case.a, drivers(case)
    external, tau = pushed(chain), np.random.default_rng(4).normal(size=chain.model.nv)

    def forward(*given, **more):
        by = chain.forward_dynamics_derivatives(q, *given, **more)
        own = by.independent_q, by.independent_v, by.independent_tau
        return [by.a_q, by.a_v, by.a_tau, own, by.independent, by.reduced_jacobian, by.v_q, by.motion.a]

    def inverse(*given, **more):
        by = chain.inverse_dynamics_derivatives(q, *given, **more)
        efforts = by.tau_q, by.tau_v, by.tau_a, by.v_q, by.a_q, by.independent
        return [efforts, by.multipliers_q, by.multipliers_v, by.multipliers_a, *of_forces(by.forces, False)]

    return all_tried(
        forward=lambda: forward(v, tau, external=external),
        chosen=lambda: forward(v, {joints[0]: 2.0}, independent=case.independent),
        still=lambda: forward(),
        inverse=lambda: inverse(v, a, actuated=joints, external=external),
        inverse_chosen=lambda: inverse(v, a, actuated=joints, independent=case.independent[::-1]),
        every=lambda: inverse(v, actuated=list(chain.model.names)[1:]),
        undriven=lambda: inverse(v, a, actuated=joints[1:]),
        too_few=lambda: forward(v, independent=case.independent[1:]),
        too_many=lambda: inverse(v, a, actuated=joints, independent=list(chain.model.names)[1:]),
        opening=lambda: inverse(v + 0.1, a, actuated=joints),
        opening_forward=lambda: forward(v + 0.1),
        no_number=lambda: chain.inverse_dynamics_derivatives(np.nan * q, v, a, actuated=joints),
        no_number_forward=lambda: chain.forward_dynamics_derivatives(np.nan * q, v),
        no_turn=lambda: chain.inverse_dynamics_derivatives(1.01 * q, v, a, actuated=joints),
        no_turn_forward=lambda: chain.forward_dynamics_derivatives(1.01 * q, v),
        shape=lambda: chain.inverse_dynamics_derivatives(q, v[1:], a),
        shape_forward=lambda: chain.forward_dynamics_derivatives(q[1:], v),
    )


def shown():
    """Which of their attributes records of forces and motion show, and which of their arrays can be written."""
    case = loaded("four-bar", friction=0.8)
    chain, q, v, a, joints = case.chain, case.q, case.v, case.a, drivers(case)
    records = [
        chain.inverse_dynamics(q, v, a, actuated=joints),
        chain.inverse_dynamics(q, actuated=joints).joint_reaction(joints[0]),
        chain.inverse_dynamics([q, q], actuated=joints),
        chain.forward_dynamics(q, v),
        chain.forward_dynamics_derivatives(q, v),
        chain.inverse_dynamics_derivatives(q, v, a, actuated=joints),
        chain.mobility(q),
        chain.description,
        chain.simulate(q, v, [0.0, 0.01]),
    ]
    public = [(record, name) for record in records for name in vars(record) if not name.startswith("_")]
    return [
        *([type(record).__name__, *re.findall(r"(\w+)=", repr(record))] for record in records),
        [
            (type(record).__name__, name)
            for record, name in public
            if isinstance(array := getattr(record, name), np.ndarray) and array.flags.writeable
        ],
    ]
