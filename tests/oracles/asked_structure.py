"""What the parts of chains are, which of them are refused, and chains that are made of others."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
from asked_chains import all_tried, tried
from asked_files import brief, in_short
from mechanisms import five_bar, four_bar, sliders

from exo_pin.chain import ClosedChain, Closure, Closures, ClosureType, JointProperties, LimbRole, Placement, Roles, Root


def refused():
    """What is said of parts that cannot be."""
    joined, place = ("c", "rigid", "one", "two"), Placement((0.1, 0.2, 0.3), (0.6, 0.0, 0.8, 0.0))
    couple = ("g", "coupling", "one", "two")
    made = [
        (Placement, ((0.0, 1.0), (0.0, 0.0, 0.0, 1.0))),
        (Placement, ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0 + 2e-9))),
        (Placement, ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0 + 0.9e-9))),
        (Placement, ((np.nan, 0.0, 0.0),)),
        (Closure, ("", "rigid", "one", "two")),
        (Closure, ("c", "rigid", "one", "")),
        (Closure, ("c", "weld", "a", "b")),
        (Closure, (*joined, (0.0, 0.0, 0.0))),
        (Closure, (*joined, place, place, (0.0, 0.0, 1.0))),
        (Closure, ("c", "revolute", "one", "two", place, place, (0.0, 3.0, 4.0))),
        (Closure, ("c", "cylindrical", "one", "two", place, place, (0.0, 0.0, 0.0))),
        (Closure, ("c", "prismatic", "one", "two", place, place, (0.0, 0.0, 1.0 + 1e-12))),
        (Closure, (*joined, place, place, None, 0.3)),
        (Closure, ("c", "distance", "one", "two")),
        (Closure, ("c", "distance", "one", "two", place, place, None, -0.3)),
        (Closure, ("c", "point", "one", "two", place, place)),
        (Closure, (*joined, place, place, None, None, (1.0,))),
        (Closure, (*joined, place, place, None, None, None, (0.0, 0.1))),
        (Closure, couple),
        (Closure, (*couple, Placement(), Placement(), None, None, (1.0, 2.0, 3.0, 4.0, 5.0, 6.0))),
        (Closure, (*couple, Placement(), Placement(), None, None, (1.0, 2.0, 3.0, 4.0, 5.0), (0.1, 0.2))),
        (Closure, (*couple, Placement(), Placement(), None, None, ())),
        (Closure, (*couple, place, Placement(), None, None, (1.0, 2.0))),
        (Closure, (*couple, Placement(), place, None, None, (1.0, 2.0))),
        (Closure, ("g", "coupling", "one", "one", Placement(), Placement(), None, None, (1.0, 2.0))),
        (Closure, ("g", "coupling", "one", "universe", Placement(), Placement(), None, None, (1.0,))),
        (Closure, ("g", "coupling", "universe", "one", Placement(), Placement(), None, None, (1.0, 2.0))),
        (Closure, ("g", "coupling", "universe", "one", Placement(), Placement(), None, None, (1.0, 0.0))),
        (ClosureType, ("own", "xyw", "")),
        (ClosureType, ("own", "xy", "joints")),
        (ClosureType, ("own", "xy", "z")),
        (LimbRole, ("l", "UPS", "s", "p", "c")),
        (LimbRole, ("l", "SPS", "", "p", "c")),
        (Roles, (("one", "one"),)),
        (Roles, ("one",)),
        (Roles, ((), None, None, None, (3,))),
        (Roles, ((), None, None, None, (LimbRole("l", "UPU", "s", "p", "c"),) * 2)),
        (Root, ("hinge",)),
        (Root, ("planar", "")),
        (Root, ("fixed", "root", (0.0, 1.0))),
        (JointProperties, ("",)),
        (JointProperties, ("one", np.inf)),
        (JointProperties, ("one", 1.0, None, (-0.1,))),
        (JointProperties, ("one", 1.0, None, (0.0, 0.1), "deg")),
        (JointProperties, ("one", 1.0, (), (), "m", "hinge")),
        (JointProperties, ("one", 2.0, (0.1, 0.2), (0.3,), "rad", "spherical")),
        (Closures, ("",)),
        (Closures, ("a", Root(), (Closure(*joined),) * 2)),
        (Closures, ("a", Root(), (3,))),
        (Closures, ("a", Root(), (), Roles(limbs=(LimbRole("l", "UPU", "s", "p", "c"),)))),
        (Closures, ("a", 3)),
        (Closures, ("a", Root(), (), Roles(), (JointProperties("one"),) * 2)),
        (Closures, ("a", Root(), (), Roles(), (), (), 1.001e-3)),
        (Closures, ("a", Root(), (), Roles(), (), (), 1e-3)),
        (Closures, ("a", Root(), (), Roles(), (), (), -1e-9)),
        (Closures, ("a", Root(), (), Roles(), (), ("x",), 0.0)),
    ]
    return [[kind.__name__, *map(in_short, _listed(tried(lambda: kind(*given))))] for kind, given in made]  # noqa: B023


def _listed(found):
    return found if isinstance(found, list) else [found]


def _tree(*joints):
    """A tree of joints, each with its parent and its mass, one after the other 0.3 m along x and 0.1 m along z."""
    model = pin.Model()
    for k, (kind, parent, mass) in enumerate(joints):
        place = pin.SE3(np.eye(3), np.array([0.3, 0.0, 0.1 * k]))
        at = model.addJoint(parent, kind, place, f"joint_{k}")
        model.addFrame(pin.Frame(f"link_{k}", at, 0, pin.SE3.Identity(), pin.FrameType.BODY))
        model.appendBodyToJoint(at, pin.Inertia(mass, 0.1 * np.ones(3), np.eye(3)), pin.SE3.Identity())
    return model


def frames_locked(*joints):
    """What the frames of a tree hang on when joints are locked, one of them on a frame that is not there."""
    model = _tree(*((pin.JointModelRZ(), k, 1.0) for k in range(3)))
    model.frames[2].parentFrame = 77
    left = ClosedChain(model, Closures("t")).locked(joints, [0.3, 0.2, 0.1]).model
    return [f"{frame.name} on {left.frames[frame.parentFrame].name}" for frame in left.frames]


def unfit():
    """What is said of descriptions that do not fit their tree, and of trees that are none."""
    named, z = four_bar(), pin.JointModelRZ()
    chain = named.chain()
    (tip,), name = chain.closures, "crank_hinge"

    def with_(**changed):
        return ClosedChain(chain.model, replace(chain.description, **changed))

    def sprung(kind, **given):
        return ClosedChain(_tree((kind, 0, 1.0)), Closures("t", joints=(JointProperties("joint_0", **given),)))

    def geared(a, b):
        gear = Closure("gear", "coupling", a, b, polynomial=(0.1, 2.0))
        ball, endless = pin.JointModelSpherical(), pin.JointModelRUBZ()
        model = _tree((z, 0, 1.0), (ball, 1, 1.0), (endless, 2, 1.0), (pin.JointModelPX(), 3, 1.0))
        return ClosedChain(model, Closures("geared", closures=(gear,)))

    def rubbing(low, high):
        model = chain.model.copy()
        model.lowerDryFrictionLimit, model.upperDryFrictionLimit = np.full(3, low), np.full(3, high)
        return ClosedChain(model, chain.description).forward_dynamics(named.q)

    def twice(*, moved):
        model = _tree((z, 0, 1.0), (z, 1, 1.0))
        model.addFrame(pin.Frame("twin", 1, 0, pin.SE3(np.eye(3), np.array([0.3, 0.0, 0.0])), pin.FrameType.BODY))
        there = pin.SE3(np.eye(3), np.array([0.3 + moved, 0.0, 0.0]))
        model.addFrame(pin.Frame("twin", 1, 0, there, pin.FrameType.OP_FRAME))
        return ClosedChain(model, Closures("twins")).placement([0.1, 0.2], "twin").translation

    limb = LimbRole("limb", "UPU", name, "none", "tip")
    return all_tried(
        frame=lambda: with_(closures=(replace(tip, frame_a="couple"),)),
        one_body=lambda: with_(closures=(replace(tip, frame_a="rocker"),)),
        actuated=lambda: with_(roles=Roles(actuated=("crank",))),
        limb=lambda: with_(roles=Roles(limbs=(limb,))),
        shoulder=lambda: with_(roles=Roles(shoulder="crank")),
        shoulder_closure=lambda: with_(roles=Roles(shoulder="tip")).roles.shoulder,
        arm=lambda: with_(roles=Roles(arm="none")),
        cuff=lambda: with_(roles=Roles(cuff="none")),
        spring=lambda: with_(joints=(JointProperties("none", 1.0),)),
        world=lambda: with_(joints=(JointProperties("universe", 1.0),)),
        unit=lambda: with_(joints=(JointProperties(name, 1.0, unit="m"),)),
        unit_right=lambda: with_(joints=(JointProperties(name, 1.0, unit="rad"),)).row_count,
        armatures=lambda: with_(joints=(JointProperties(name, 1.0, armature=(0.1, 0.2)),)),
        reference=lambda: with_(joints=(JointProperties(name, 1.0, (0.1, 0.2)),)),
        ball=lambda: sprung(pin.JointModelSpherical(), stiffness=2.0, spring_reference=(0.0, 0.0, 0.0, 1.1)),
        ball_unit=lambda: sprung(pin.JointModelSpherical(), stiffness=2.0, unit="m"),
        flight_unit=lambda: sprung(pin.JointModelFreeFlyer(), stiffness=2.0, unit="m"),
        endless=lambda: sprung(pin.JointModelRUBZ(), stiffness=2.0),
        endless_none=lambda: sprung(pin.JointModelRUBZ(), stiffness=0.0).model.nv,
        planar=lambda: sprung(pin.JointModelPlanar(), stiffness=2.0),
        friction_up=lambda: rubbing(0.1, 0.3),
        friction_down=lambda: rubbing(-0.1, -0.05),
        friction_endless=lambda: rubbing(-np.inf, 1.0),
        friction_endless_up=lambda: rubbing(-1.0, np.inf),
        friction=lambda: rubbing(-0.1, 0.3).a,
        gear_none=lambda: geared("joint_0", "none"),
        gear_ball=lambda: geared("joint_0", "joint_1"),
        gear_endless=lambda: geared("joint_2", "joint_0"),
        gear=lambda: geared("joint_3", "joint_0").metres,
        rack=lambda: [geared("joint_0", "joint_3").characteristic_length, geared("joint_0", "joint_3").row_count],
        frames=lambda: [frames_locked("joint_1"), frames_locked("joint_0", "joint_2")],
        twin=lambda: twice(moved=0.1),
        near_twin=lambda: twice(moved=1e-13),
        far_twin=lambda: twice(moved=1e-11),
        axis_down=lambda: with_(
            closures=(Closure("pin", "revolute", "coupler", "rocker", axis=(0.0, 0.0, -1.0)),)
        ).constraint_jacobian(named.q),
        universal=lambda: ClosedChain(
            _tree((pin.JointModelUniversal(np.eye(3)[0], np.eye(3)[1]), 0, 1.0)), Closures("t")
        ),
        mass=lambda: ClosedChain(_tree((z, 0, 1.0), (z, 1, -1e-9)), Closures("t")),
        no_mass=lambda: ClosedChain(_tree((z, 0, np.nan)), Closures("t")),
        branches=lambda: ClosedChain(_tree((z, 0, 1.0), (z, 0, 1.0), (z, 1, 1.0)), Closures("t")),
        deep=lambda: (
            ClosedChain(_tree((z, 0, 1.0), (z, 1, 1.0), (z, 2, 1.0), (z, 1, 1.0), (z, 0, 1.0)), Closures("t")).model.nv
        ),
        type=lambda: chain.with_closure(3),
        tolerance=lambda: chain.with_tolerance(2e-3),
        rows=lambda: chain.rows("none"),
        joint=lambda: chain.configuration_slice("none"),
        joints=lambda: chain.velocity_indices(3),
        body=lambda: chain.placement(named.q, "none"),
        q=lambda: chain.residual(named.q[:2]),
        v=lambda: chain.constraint_drift(named.q, [1.0, 2.0]),
        not_a_number=lambda: chain.residual([np.nan, 0.0, 0.0]),
        large=lambda: chain.residual([1e200, 0.0, 0.0]),
        words=lambda: chain.residual(["a", "b", "c"]),
        both=lambda: ClosedChain(
            chain.model, replace(chain.description, closures=(replace(tip, name=name),))
        ).joint_reaction(name, named.q, actuated=[name]),
        unnormalised=lambda: ClosedChain(_tree((pin.JointModelSpherical(), 0, 1.0)), Closures("t")).residual(
            [0.0, 0.0, 0.0, 1.0 + 2e-9]
        ),
        unnormalised_cosine=lambda: ClosedChain(_tree((pin.JointModelRUBZ(), 0, 1.0)), Closures("t")).placements(
            [0.6, 0.81]
        ),
    )


def parts_of(chain, q):
    """Sizes, indices, signs, and chains that are made of a chain: a mirror image, and some with joints locked."""
    names = list(chain.model.names)[1:]
    signs = chain.mirror_signs()
    image = chain.mirrored()

    def locked(*joints, at=q):
        held = chain.locked(joints, at)
        return brief(held)

    return all_tried(
        sizes=lambda: [chain.row_count, chain.metres, chain.characteristic_length, repr(chain), chain.neutral()],
        indices=lambda: (
            [[str(chain.configuration_slice(name)), str(chain.velocity_slice(name))] for name in names]
            + [str(chain.rows(each.name)) for each in chain.closures]
            + [chain.velocity_indices(names[::-1])]
        ),
        constraints=lambda: [
            [
                str(m.type),
                m.joint1_id,
                m.joint2_id,
                m.joint1_placement.homogeneous[:3],
                m.joint2_placement.homogeneous[:3],
                m.name,
            ]
            for m in chain.constraint_models
        ],
        signs=lambda: [signs.configuration, signs.motion, signs.rows],
        image=lambda: brief(image),
        image_open=lambda: image.residual(signs.configuration * chain.neutral()),
        again=lambda: [
            a == b for a, b in zip(map(str, brief(image.mirrored())[0]), map(str, brief(chain)[0]), strict=True)
        ],
        first=lambda: locked(names[0]),
        last=lambda: locked(names[-1], names[1]),
        all=lambda: locked(*names),
        drawn=lambda: locked(*names, at=None),
        none=lambda: locked(),
        world=lambda: locked("universe"),
        unknown=lambda: locked("none"),
        reference=lambda: chain.reference_configuration("none"),
        without=lambda: brief(chain.without_friction())[0][5],
        tolerant=lambda: [
            chain.with_tolerance(1e-4).description.tolerance,
            chain.with_tolerance(0.0).description.rounding,
        ],
    )


def geared_arms():
    """A chain with couplings of each kind of joints, and what is left of these when joints are locked."""
    model = five_bar().chain().model
    names = list(model.names)[1:]
    slide = sliders(0.7).chain()
    bent = Closure("bent", "coupling", names[0], names[1], polynomial=(0.1, -0.5, 0.3, 0.2), references=(0.2, -0.1))
    straight = Closure("straight", "coupling", names[2], names[3], polynomial=(0.3, 2.0))
    held = Closure("held", "coupling", "universe", names[3], polynomial=(0.4,), references=(0.0, 0.1))
    rack = Closure("rack", "coupling", "slide_x", "slide_y", polynomial=(0.05, 0.5))
    chain = ClosedChain(model, Closures("geared", closures=(bent, straight)))
    still = ClosedChain(model, Closures("held", closures=(held,)))
    q = chain.close(np.array([0.3, 0.2, 0.1, 0.4]))

    def locked(joints, at=q, chain=chain):
        return brief(chain.locked(joints, at))[0][-1]

    return all_tried(
        closed=lambda: [q, chain.constraint_jacobian(q), chain.constraint_drift(q, [1.0, 2.0, -1.0, 0.5])],
        leader=lambda: locked(names[0]),
        follower=lambda: locked([names[1]]),
        both=lambda: locked(names[:2]),
        wrong=lambda: locked(names[:2], q + 0.1),
        unreached=lambda: locked([names[1]], q + np.array([0.0, 50.0, 0.0, 0.0])),
        straight=lambda: locked(names[2:3]),
        back=lambda: locked(names[3:]),
        other=lambda: locked(names[1:3]),
        still=lambda: locked(names[3:], q, still),
        still_kept=lambda: locked(names[:1], q, still),
        rack=lambda: [slide.with_closure(rack).residual([0.1, 0.2, 0.3]), slide.with_closure(rack).metres],
    )


def moves(chain, q):
    """Rows of the loops, forces of springs and dampers, their energy and their changes."""
    rng = np.random.default_rng(21)
    v, a, off = rng.normal(size=(3, chain.model.nv))
    away, names = pin.integrate(chain.model, q, 0.8 * off), list(chain.model.names)[1:]
    v = chain.project_velocity(q, v)
    a, parts = chain.project_acceleration(q, v, a), ("q", "energy", "dissipated")
    return all_tried(
        rows=lambda: [chain.residual(away), chain.constraint_jacobian(away), chain.constraint_drift(away, off)],
        closed=lambda: [chain.constraint_jacobian(q), chain.constraint_drift(q, v), chain.close(away)],
        efforts=lambda: [
            chain.inverse_dynamics(q, v, a, actuated=names).tau,
            chain.inverse_dynamics(q, actuated=names).tau,
        ],
        falls=lambda: [chain.forward_dynamics(q, v).a, chain.forward_dynamics(q).a],
        stack=lambda: chain.inverse_dynamics([q, q], np.stack([v, 0.0 * v]), 0.0 * a, actuated=names).tau,
        run=lambda: [getattr(run, name) for run in [chain.simulate(q, v, [0.0, 0.05])] for name in parts],
        changes=lambda: chain.inverse_dynamics_derivatives(q, v, a, actuated=names).tau_q,
        changes_forward=lambda: chain.forward_dynamics_derivatives(q, v).a_q,
    )


def flying():
    """A free body on a spring with a hinge on it, which has a spring, too."""
    model = _tree(
        (pin.JointModelFreeFlyer(), 0, 2.0), (pin.JointModelRX(), 1, 1.0), (pin.JointModelTranslation(), 2, 0.5)
    )
    model.damping = np.linspace(0.1, 1.0, model.nv)
    turn = tuple(pin.Quaternion(pin.exp3(np.array([0.3, -0.2, 0.5]))).coeffs().tolist())
    springs = (
        JointProperties("joint_0", 7.0, (0.1, -0.2, 0.3, *turn)), JointProperties("joint_1", 3.0, (0.4,)),
        JointProperties("joint_2", 5.0, (0.1, 0.2, -0.1)),
    )  # fmt: skip
    tie = Closure("tie", "distance", "link_0", "universe", Placement((0.1, 0.0, 0.2)), distance=0.9)
    chain = ClosedChain(model, Closures("flying", closures=(tie,), joints=springs))
    return moves(chain, chain.close(pin.integrate(model, chain.neutral(), 0.3 * np.arange(-4.0, 6.0) / 4.0)))


def limited():
    """A tree of joints of one to six coordinates with limits: which are passed, and where a gear closes within them."""
    kinds = (
        pin.JointModelFreeFlyer(), pin.JointModelPlanar(), pin.JointModelTranslation(), pin.JointModelRUBX(),
        pin.JointModelPZ(), pin.JointModelRY(),
    )  # fmt: skip
    model = _tree(*((kind, parent, 1.0) for kind, parent in zip(kinds, (0, 1, 1, 3, 3, 0), strict=True)))
    model.lowerPositionLimit, model.upperPositionLimit = -0.1 * np.arange(1.0, model.nq + 1), np.full(model.nq, 0.7)
    at = model.idx_qs[3]
    model.upperPositionLimit = np.array(
        [*model.upperPositionLimit[: at + 1], np.inf, *model.upperPositionLimit[at + 2 :]]
    )
    gear = Closure("gear", "coupling", "joint_4", "joint_5", polynomial=(0.2, 1.5))
    chain = ClosedChain(model, Closures("limited", closures=(gear,)))
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    rng, start = np.random.default_rng(3), chain.neutral()
    far = [pin.integrate(model, start, size * rng.normal(size=model.nv)) for size in (0.1, 0.5, 1.0, 2.0)]
    edge, past = start.copy(), start.copy()
    for k in (3, 5, 6):
        own = slice(model.idx_qs[k], model.idx_qs[k] + model.nqs[k])
        edge[own], past[own] = np.clip(high[own], -9.0, 0.7), low[own] - 1e-12
    above = model.copy()
    above.lowerPositionLimit = np.full(model.nq, -np.inf)
    above.upperPositionLimit = np.where(np.arange(model.nq) % 2, 0.3, np.inf)
    above = ClosedChain(above, chain.description)
    held = chain.inverse_dynamics(chain.close(far[0]), actuated=list(model.names)[1:])
    return all_tried(
        beyond=lambda: [chain.beyond_limits(q) for q in (*far, start, edge, past, edge + 1e-12 * (edge != start))],
        within=lambda: [tried(lambda q=q: chain.close(q, respect_limits=True)) for q in far],
        held=lambda: chain.close(far[2], hold=["joint_4"], respect_limits=True),
        held_beyond=lambda: chain.close(far[2], hold=["joint_2"], respect_limits=True),
        above=lambda: [[above.beyond_limits(q), tried(lambda q=q: above.close(q, respect_limits=True))] for q in far],
        free=lambda: [chain.close(far[2]), chain.metres, chain.characteristic_length],
        moved=lambda: [chain.constraint_jacobian(far[1]), chain.frame_jacobian(chain.close(far[1]), "link_4")],
        weight=lambda: [held.tau, held.wrench_on("universe").wrench],
    )
