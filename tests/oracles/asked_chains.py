"""What a chain answers to questions of many kinds, as plain data that other machines give, too."""

import re

import numpy as np
import pinocchio as pin

import exo_pin as ep

#: What is rounding and therefore no answer.
_ROUNDING = re.compile(r"equations of motion hold to .*")
#: How far many steps have come is chance.
_STEPS = re.compile(r"\S+ \(m, rad\) (are left )?after \d\d+ iterations")
_LONG = re.compile(r"-?\d+\.\d{7,}(?:e[+-]?\d+)?|-?\d+(?:\.\d+)?e[+-]\d+")


def tried(question):
    """What is answered, or the error in words."""
    try:
        return question()
    except ep.ExoPinError as error:
        said = [str(error), *getattr(error, "__notes__", ()), getattr(error, "key", None) or ""]
        return [type(error).__name__, *_STEPS.sub("some", "\n".join(said)).splitlines()]


def all_tried(**questions):
    """The answers to questions by name."""
    return {name: [tried(question)] for name, question in questions.items()}


def short(text):
    """A text on one line, its long numbers with six digits."""
    return " ".join(_LONG.sub(lambda found: f"{float(found[0]):.6g}", text).split())


def projector(basis):
    """What a basis spans, however it is turned; nothing if it is empty."""
    if basis.ndim == 3:
        return [projector(one) for one in basis]
    if not basis.any():
        return basis.shape[0]
    left, sizes, _ = np.linalg.svd(basis, full_matrices=False)
    left = left[:, sizes > 1e-9 * sizes[0]]
    return left @ left.T


def parts_of(chain):
    """The tree, its data and its description."""
    model = chain.model
    data = {
        name: getattr(model, name)
        for name in (
            "lowerPositionLimit",
            "upperPositionLimit",
            "lowerVelocityLimit",
            "upperVelocityLimit",
            "lowerEffortLimit",
            "upperEffortLimit",
            "damping",
            "armature",
            "lowerDryFrictionLimit",
            "upperDryFrictionLimit",
        )
    }
    data = {name: np.nan_to_num(value, posinf=1e6, neginf=-1e6) for name, value in data.items()}
    joints = {
        model.names[k]: (
            model.joints[k].shortname(),
            int(model.parents[k]),
            model.jointPlacements[k].homogeneous[:3].ravel(),
            model.inertias[k].toDynamicParameters(),
        )
        for k in range(1, model.njoints)
    }
    frames = {
        f"{frame.name} {frame.type}": (int(frame.parentJoint), frame.placement.homogeneous[:3].ravel())
        for frame in model.frames
        if frame.type in (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
    }
    at = {item.key(): item.data() for item in model.referenceConfigurations}
    gravity = np.array(model.gravity.linear)
    return {"joints": joints, "frames": frames, "data": data, "at": at, "gravity": gravity, "is": chain.description}


def of_reaction(reaction):
    """A wrench with what is unique in it."""
    ranges = [] if reaction.unique.all() else np.nan_to_num(reaction.interval, posinf=1e6, neginf=-1e6)
    return [[short(str(reaction)), reaction.wrench, ranges, projector(reaction.directions)]]


def of_forces(forces, intervals=True):
    """Efforts, multipliers, friction and reactions of all parts of a chain."""
    state = forces.equations.state
    joints, closures = list(state.model.names)[1:], [each.name for each in state.closures[-1:]]
    said = [line for line in str(forces).splitlines() if not _ROUNDING.match(line)]
    found = [short(" ".join(said)), forces.tau, forces.multipliers, forces.friction, forces.effort_is_unique]
    found += [projector(forces.self_stresses), forces.cautions, bool(forces.residual < 1e-8)]
    if intervals:
        found += [tried(lambda k=k: of_reaction(forces.joint_reaction(k, at=[0.1, -0.2, 0.3]))) for k in joints[-2:]]
        for name in closures:
            found += [tried(lambda name=name: of_reaction(forces.joint_reaction(name, in_frame="local")))]
            found += [tried(lambda name=name: list(forces.coupling(name).items()))]
        found += [
            np.clip([*forces.effort_interval(name), *forces.friction_interval(name)], -1e6, 1e6) for name in joints
        ]
        body = list(state.body_names)[-1]
        found += [tried(lambda: of_reaction(forces.wrench_on(body, in_frame=body)))]
    return [found]


def of_mobility(found):
    """A mobility without its singular values that are rounding."""
    said = [line for line in str(found).splitlines() if found.geometry or "count as zero" not in line]
    values = np.where(found.singular_values > 1e-9, found.singular_values, 0.0)
    margins = [] if found.margins is None else [found.margins.frame, *found.margins.effort.items()]
    margins += [] if found.margins is None else [*found.margins.travel.items()]
    ranks = found.rank, found.regular_rank, found.redundant, found.degrees_of_freedom, found.idle, found.freedoms
    text = re.sub(r"(?<=agree with others to )-?\S+e-(1[4-9]|[2-9]\d)|-?0\.0e\+00", "rounding", " ".join(said))
    here = [short(text), values, margins, found.verdict, found.cautions, ranks]
    here += [1e9 * found.geometry, 1e6 * found.known]
    return [here] if found.locked is None else [here, *of_mobility(found.locked)]


def kinematics_of(chain, q, independent, seed=5):
    """Loops, poses and motions of a chain at a closed configuration."""
    rng = np.random.default_rng(seed)
    v, a, away = rng.normal(size=(3, chain.model.nv))
    away = pin.integrate(chain.model, q, 0.3 * away * np.where(chain.metres, chain.characteristic_length, 1.0))
    frame = str(chain.model.frames[chain.model.nframes - 1].name)
    given, there = rng.normal(size=(2, len(chain.velocity_indices(independent)))), chain.placement(q, frame)
    turned = there * pin.exp6(np.array([0.01, -0.02, 0.015, 0.05, -0.03, 0.04]))
    moved = list(independent)[:1]
    pushed = q.copy()
    own = chain.configuration_slice(moved[0])
    if own.stop - own.start == 1:
        pushed[own] += 0.07 * (chain.characteristic_length if chain.metres[chain.velocity_indices(moved)[0]] else 1.0)
    some = chain.dependent_motion(q, independent, *given)
    return all_tried(
        open=lambda: [chain.residual(away), chain.constraint_jacobian(away), chain.constraint_drift(away, v)],
        closed=lambda: [chain.constraint_jacobian(q), chain.constraint_drift(q, v), chain.beyond_limits(3.0 * away)],
        places=lambda: [[name, place.homogeneous[:3]] for name, place in chain.placements(away).items()],
        split=lambda: [[*vars(chain.split(q, which)).values()] for which in (None, independent)],
        too_few=lambda: chain.split(q, independent[1:]),
        too_many=lambda: chain.split(q, list(chain.model.names)[1:]),
        twice=lambda: chain.dependent_motion(q, list(chain.model.names)[1:], v),
        reduced=lambda: [chain.reduced_jacobian(q), chain.reduced_jacobian(q, independent[::-1])],
        frame=lambda: chain.frame_jacobian(q, frame, independent),
        motion=lambda: [some, chain.dependent_motion(q, independent, given[0])],
        projected=lambda: [chain.project_velocity(q, v), chain.project_acceleration(q, some[0], a)],
        near=lambda: chain.close(away),
        stack=lambda: chain.close([away, q, pin.integrate(chain.model, q, 0.1 * v)]),
        held=lambda: chain.close(away, hold=moved, restarts=2),
        pushed=lambda: chain.close(pushed, hold=moved),
        within=lambda: chain.close(pushed, respect_limits=True, max_iterations=30),
        few_steps=lambda: chain.close(away, max_iterations=2, restarts=0, tolerance=1e-3),
        forward=lambda: chain.forward_kinematics(pushed[own], q, moved),
        inverse=lambda: [
            chain.inverse_kinematics(frame, there, near=away, part="position", respect_limits=False),
            chain.inverse_kinematics(frame, turned, near=q, part="position"),
        ],
        unreached=lambda: chain.inverse_kinematics(frame, turned, near=q),
        mobility=lambda: of_mobility(chain.mobility(q)),
        output=lambda: of_mobility(chain.mobility(q, actuated=independent, frame=frame, part="position")),
        lock=lambda: of_mobility(chain.mobility(q, locked=moved, frame=frame)),
        open_refused=lambda: chain.mobility(away),
    )
