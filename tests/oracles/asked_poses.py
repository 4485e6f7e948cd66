"""What is asked of rounded and singular mechanisms, of branches, limits and all assemblies of a chain."""

import re

import numpy as np
from asked_chains import all_tried, of_mobility, tried
from mechanisms import five_bar, four_bar, planar_3rrr, random_loop, with_free_hinge
from rounded_mechanisms import mechanism
from singular_poses import POSES, REGULAR
from spatial_mechanisms import stewart

from exo_pin import BeyondLimits, LoopNotClosed
from exo_pin.chain import ClosedChain, Closure, Placement

#: Ground, crank, coupler and rocker of a crank-rocker, m.
_BARS = 1.0, 0.5, 1.2, 0.8


def rounded(digits, names, seed=3):
    """Mobility and motion of mechanisms whose geometry is rounded."""

    def asked(name):
        chain = mechanism(name, digits, seed)
        q = chain.close(np.zeros(chain.model.nq))
        away = chain.close(q + 0.05 * np.arange(chain.model.nq))
        driven = [f"hinge_{5 * k}" for k in range(3 if name == "delta" else 1)]
        v, a = chain.dependent_motion(q, driven, np.ones(len(driven)))
        found = chain.forward_dynamics(q, v)
        held = chain.inverse_dynamics(q, v, found.a, actuated=driven)
        return [q, away, *of_mobility(chain.mobility(q, actuated=driven)), v, a, found.a, held.tau, held.cautions]

    return all_tried(**{name: lambda name=name: asked(name) for name in names})


def singular(digits, names):
    """Mobility and forces in singular poses and in regular ones."""
    poses = POSES | REGULAR

    def asked(name):
        chain = poses[name].chain(digits, seed=2)
        q = chain.close(chain.neutral()) if digits else chain.neutral()
        frame = chain.model.frames[chain.model.nframes - 1].name
        parts = [of_mobility(chain.mobility(q, frame=frame, part=part)) for part in ("pose", "position", "orientation")]
        return [*parts, of_mobility(chain.mobility(q))]

    def forces(name):
        chain = poses[name].chain(digits, seed=2)
        found = chain.inverse_dynamics(chain.neutral())
        return [found.tau, found.cautions, found.undetermined]

    def refused(name):
        # In symmetric poses several joints lack the same force.
        found = tried(lambda: forces(name))
        return [re.sub(" in [^;]*", "", each) if isinstance(each, str) else each for each in found]

    return all_tried(**{name: lambda name=name: asked(name) for name in names}) | all_tried(
        **{f"{name}: forces": lambda name=name: refused(name) for name in names}
    )


def _bar(name, at, length, inside="", limits=""):
    joint = (
        f'<joint name="{name}" axis="0 -1 0" {limits}/><geom type="capsule" fromto="0 0 0 {length} 0 0" size="0.01"/>'
    )
    return f'<body name="{name}" pos="{at} 0 0">{joint}{inside}</body>'


def crank_rocker(limits=""):
    """A crank-rocker that is open between coupler and rocker, the rocker with limits."""
    ground, crank, coupler, rocker = _BARS
    bars = _bar("crank", 0.0, crank, _bar("coupler", crank, coupler)) + _bar("rocker", ground, rocker, limits=limits)
    pin = Closure("pin", "spherical", "coupler", "rocker", Placement((coupler, 0, 0)), Placement((rocker, 0, 0)))
    compiler = '<compiler angle="radian"/>'
    return ClosedChain.from_mjcf(f"<mujoco>{compiler}<worldbody>{bars}</worldbody></mujoco>").with_closure(pin)


def branches():
    """Held joints, paths and targets on the branches of a crank-rocker and a five-bar, with limits on the way."""
    chain, limited = crank_rocker(), crank_rocker('range="1.2 2.2"')
    start = chain.close([0.7, 0.3, 1.6])
    other = chain.close([0.7, -2.3, -1.6])
    turned = np.array([3.1, *start[1:]])
    tip = chain.placement(chain.forward_kinematics([2.4], start, ["crank"]), "rocker")
    five = five_bar().chain()
    q5 = five.close(five_bar().q)
    reach = five.placement(q5, "tip").copy()
    reach.translation += np.array([0.03, 0.02, 0.0])
    across = reach.copy()
    across.translation += np.array([-0.06, -0.45, 0.0])
    far = reach.copy()
    far.translation += np.array([2.0, 0.0, 0.0])
    known = limited.with_tolerance(1e-5)
    left, three = five_bar().q + np.array([0.2, 0.0, 0.0, 0.0]), planar_3rrr()

    def from_afar(seed):
        """Closed from where it takes six or more new starts, each of its angles in one turn."""
        start = three.q + np.random.default_rng(seed).uniform(-3.0, 3.0, len(three.q))
        return np.mod(three.chain().close(start) + 1e-7, 2 * np.pi)

    return all_tried(
        from_afar=lambda: [from_afar(seed) for seed in (12, 40)],
        start=lambda: [start, other],
        held=lambda: [chain.close(turned, hold=["crank"]), chain.close(turned, hold="crank")],
        held_other=lambda: chain.close([2.2, *other[1:]], hold=["crank"]),
        held_open=lambda: chain.close([2.0, 0.5, 2.9], hold=["crank"]),
        impossible=lambda: chain.close([start[0], start[1], start[2] + 2.5], hold=["crank", "rocker"]),
        rocker=lambda: chain.close([*start[:2], start[2] + 0.2], hold=["rocker"]),
        rocker_far=lambda: chain.close([*start[:2], start[2] + 1.1], hold=["rocker"], restarts=3),
        limits=lambda: [
            limited.beyond_limits(start),
            limited.beyond_limits([0.0, 0.0, 1.1]),
            limited.beyond_limits(turned),
        ],
        within=lambda: limited.close([0.7, -2.3, -1.6], respect_limits=True),
        within_held=lambda: limited.close(turned, hold=["crank"], respect_limits=True),
        known=lambda: [known.close([0.7, 0.3, 1.5]), known.close([0.75, 0.06, 0.7], respect_limits=True)],
        known_held=lambda: [known.close(turned, hold=["crank"]), known.close([0.4, 0.3, 1.5], hold=["rocker"])],
        known_beyond=lambda: known.close([*start[:2], 0.4], hold=["rocker"], respect_limits=True),
        known_folded=lambda: known.close([0.1, 2.9, 0.4], restarts=5),
        folded=lambda: [chain.close([0.1, 2.9, -0.4], restarts=5), five.close([0.4, 2.6, 2.7, -2.6], restarts=6)],
        folded_held=lambda: five.close([0.4, 2.6, 2.7, -2.6], hold=["left_crank_hinge"], restarts=6),
        within_none=lambda: limited.close([0.4, 0.3, 1.0], hold=["crank"], respect_limits=True),
        path=lambda: chain.forward_kinematics([2.4], start, ["crank"]),
        whole_turn=lambda: chain.forward_kinematics([start[0] + 2 * np.pi], start, ["crank"]),
        path_ends=lambda: chain.forward_kinematics([start[2] + 1.5], start, ["rocker"]),
        no_path=lambda: chain.forward_kinematics([1.0], start),
        shape=lambda: chain.forward_kinematics([1.0, 2.0], start, ["crank"]),
        target=lambda: chain.inverse_kinematics("rocker", tip, near=start),
        target_limited=lambda: limited.inverse_kinematics("rocker", tip, near=start),
        target_beyond=lambda: limited.inverse_kinematics("rocker", tip, near=start, respect_limits=False),
        target_drawn=lambda: chain.inverse_kinematics("rocker", tip),
        tip=lambda: five.inverse_kinematics("tip", reach, near=q5, part="position"),
        tip_held=lambda: five.inverse_kinematics("tip", reach, near=q5, part="position", hold=["left_crank_hinge"]),
        tip_across=lambda: five.inverse_kinematics("tip", across, near=q5, part="position"),
        tip_far=lambda: five.inverse_kinematics("tip", far, near=q5, part="position"),
        tip_open=lambda: five.inverse_kinematics("tip", reach, near=left, part="position"),
        part=lambda: five.inverse_kinematics("tip", reach, near=q5, part="orientation"),
        no_pose=lambda: five.inverse_kinematics("tip", [0.0, 0.1, 0.0], near=q5),
        stack=lambda: chain.close([start, turned, [0.2, 0.3, 0.4]], restarts=1),
        stack_held=lambda: chain.close([start, turned, [0.2, 0.3, 0.4]], hold=["crank"]),
        stack_fails=lambda: chain.close([start, [0.7, 0.3, 0.3]], hold=["crank", "coupler"]),
        loosely=lambda: chain.close([0.7, 0.3, 1.7], tolerance=1e-3) - chain.close([0.7, 0.3, 1.7]),
        no_tolerance=lambda: chain.close(start, tolerance=0.0),
        no_steps=lambda: [chain.close(start, max_iterations=0), chain.close(start, restarts=0)],
        half_steps=lambda: chain.close(start, max_iterations=1.5),
        few=lambda: chain.close([0.2, 0.3, 0.4], max_iterations=1, restarts=0),
        free=lambda: of_mobility(
            with_free_hinge(four_bar()).mobility(np.append(four_bar().q, 0.3), actuated=["crank_hinge"])
        ),
        free_left=lambda: with_free_hinge(four_bar()).reduced_jacobian(np.append(four_bar().q, 0.3), ["crank_hinge"]),
        locked_twice=lambda: chain.mobility(start, locked=["crank"], actuated=["crank"]),
        radial=lambda: of_mobility(planar_3rrr(radial=True).chain().mobility(planar_3rrr(radial=True).q)),
    )


def assembled():
    """All assemblies of chains with joints held, with few and with many starts."""
    chain, five = crank_rocker(), five_bar().chain()
    start, q5 = chain.close([0.7, 0.3, 1.6]), five.close(five_bar().q)
    platform = POSES["3-RPR, limbs concurrent"].chain()

    def of(chain, held, q, **more):
        found = chain.assemblies(held, q, **more)
        # Which of equally good ones is first is chance: they are in the order of their numbers.
        order = np.lexsort(np.round(np.mod(found.configurations + 1e-7, 2 * np.pi), 5).T)
        rows = np.mod(found.configurations[order] + 1e-7, 2 * np.pi)
        return [
            rows,
            found.margins[order],
            found.meeting[order],
            len(found),
            found.is_complete,
            str(found).split(" from ")[0],
        ]

    few, loop = {"starts": 3}, random_loop("revolute")
    return all_tried(
        # How many of the starts lead to each, of which most get stuck on the way.
        hits=lambda: loop.chain().assemblies(["left_0_joint", "left_1_joint"], loop.q, starts=96).hits.tolist(),
        crank=lambda: of(chain, ["crank"], start),
        frame=lambda: of(chain, "crank", start, frame="rocker", seed=4),
        rocker=lambda: of(chain, ["rocker"], start, seed=2),
        five=lambda: of(five, five.roles.actuated, q5),
        five_frame=lambda: of(five, five.roles.actuated, q5, frame="tip"),
        few=lambda: [
            chain.assemblies(["crank"], start, **few).starts,
            chain.assemblies(["crank"], start, **few).is_complete,
        ],
        drawn=lambda: of(chain, ["crank"], None),
        loose=lambda: of(five, ["left_crank_hinge"], q5),
        none=lambda: of(chain, ["crank", "rocker"], start + np.array([0.0, 0.0, 1.0]), starts=20),
        no_starts=lambda: chain.assemblies(["crank"], start, starts=0),
        unknown=lambda: chain.assemblies(["none"], start),
        platform=lambda: of(platform, platform.roles.actuated, platform.neutral() + 0.05, starts=300),
        flight=lambda: stewart().chain().assemblies(["flight"], stewart().q, starts=4).starts,
    )


def steps():
    """Where loops are after each of the first steps, from near and far, with joints held and without."""

    def after(chain, start, count, **more):
        try:
            return chain.close(start, max_iterations=count, restarts=0, **more)
        except (BeyondLimits, LoopNotClosed) as error:
            return [error.q, getattr(error, "residual", 0.0)]

    bar, five, loop = four_bar().chain(), five_bar().chain(), random_loop("universal")
    cases = {
        "near": (bar, four_bar().q + np.array([0.05, -0.03, 0.02]), {}),
        "far": (bar, four_bar().q + np.array([1.5, -2.3, 1.2]), {}),
        "held": (bar, four_bar().q + np.array([0.35, -0.3, 0.2]), {"hold": ["crank_hinge"]}),
        "unreached": (bar, np.array([0.1, 0.2, 3.0]), {"hold": ["crank_hinge", "rocker_hinge"]}),
        "five": (five, five_bar().q + np.array([0.9, -1.3, 0.2, 0.7]), {}),
        "loop": (loop.chain(), loop.q + 0.6 * np.arange(-3, 4), {}),
        "limited": (crank_rocker('range="1.2 2.2"'), np.array([0.7, -2.3, -1.6]), {"respect_limits": True}),
    }
    return {
        name: [after(chain, start, count, **more) for count in (*range(1, 13), 16, 20, 26)]
        for name, (chain, start, more) in cases.items()
    }
