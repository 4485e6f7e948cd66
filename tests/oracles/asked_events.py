"""What is asked of motions that stick, slip, hit stops, are stiff or go through singular poses."""

import numpy as np
from asked_chains import all_tried, of_forces, short, tried
from asked_dynamics import loaded
from asked_poses import crank_rocker
from mechanisms import flat_parallelogram, four_bar
from published_problems import parallel_windows
from rubbing_chains import slide, with_friction

from exo_pin.chain import ClosedChain, Closures, JointProperties

#: A crank of 0.1 m, a rod of 0.3 m and a slider on the crank's line, with a stop, and weight across the plane.
CRANK = """<mujoco model="slider_crank"><option gravity="0.4 0 -3"/><compiler angle="radian"/>
  <default><geom type="capsule" size="0.01"/><joint axis="0 1 0"/></default>
  <worldbody>
    <body name="crank"><joint name="crank" {crank}/><geom fromto="0 0 0 0.1 0 0" mass="0.5"/>
      <body name="rod" pos="0.1 0 0"><joint name="rod"/><geom fromto="0 0 0 0.3 0 0" mass="0.3"/>
        <site name="rod_end" pos="0.3 0 0"/></body></body>
    <body name="slider" pos="0.4 0 0"><joint name="slider" type="slide" axis="1 0 0" {slider}/>
      <geom fromto="-0.02 0 0 0.02 0 0" mass="0.8"/><site name="pin"/></body>
  </worldbody><equality><connect name="loop" site1="rod_end" site2="pin"/></equality></mujoco>"""
#: Three hinges without mass between them, of which two turn about one line where the middle one is at a right angle.
GIMBAL = """<mujoco><worldbody><body><joint name="x" axis="1 0 0"/><joint name="y" axis="0 1 0"/>
<joint name="z" axis="0 0 1"/><inertial pos="0 0 -0.3" mass="1" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
#: A parallelogram of cranks 0.3 m long, folded flat at zero, under its weight.
FLAT = """<mujoco><worldbody>
<body name="a"><joint name="j" axis="0 1 0"/><geom size=".05" mass="1" pos=".15 0 0"/>
<body name="b" pos=".3 0 0"><joint name="k" axis="0 1 0"/><geom size=".05" mass="1.4" pos=".6 0 0"/>
<body name="c" pos="1 0 0"><joint name="l" axis="0 1 0"/><geom size=".05" mass=".8" pos="-.15 0 0"/>
<site name="s" pos="-.3 0 0"/></body></body></body><site name="w" pos="1 0 0"/></worldbody>
<equality><connect site1="s" site2="w"/></equality></mujoco>"""


def of_run(chain, *given, **more):
    """A motion in time with its events and its balance of energy."""
    found = chain.simulate(*given, **more)
    events = [[each.kind, each.time, each.joints, each.order, each.branch] for each in found.events]
    work = [found.energy, found.kinetic_energy, found.work, found.dissipated]
    sure = bool(found.opening.max() < 1e-9), bool(found.energy_drift < 1e-6)
    return [found.q, found.v, work, sure, events]


def contact_of(found):
    """An acceleration with what friction and stops do to it."""
    sure = found.contact_is_unique
    rest = [np.where(sure, found.friction, 0.0), np.where(sure, found.stop_reactions, 0.0), sure]
    # Of several forces that make the same motion, which one is found is chance.
    return [found.a, *rest, of_forces(found.forces, False) if sure.all() else []]


def blocks():
    """A block on an incline, a spring, a ramp of force and a stop."""
    pull, times = 2.0 * 9.81 * np.sin(0.3), [0.0, 0.1, 0.7]
    rough, slippery = slide(0.3, 1.2 * pull), slide(0.3, 0.5 * pull)
    stopped, falling = slide(0.4, 0.3, limits=(-0.05, 0.2)), slide(np.pi / 2, limits=(0.0, np.inf))
    sprung = slide(0.0, 1.0, 2.0)
    sprung = ClosedChain(sprung.model, Closures("slide", joints=(JointProperties("slide", 50.0),)))
    return all_tried(
        up=lambda: of_run(rough, [0.0], [1.5], times),
        back=lambda: of_run(slippery, [0.0], [0.5], times),
        rests=lambda: of_run(rough, [0.0], [0.0], times),
        swing=lambda: of_run(sprung, [0.21], [0.0], [0.0, 0.6, 1.3, 2.1]),
        ramp=lambda: of_run(slide(0.0, 3.0), [0.0], [0.0], [0.0, 0.5, 1.4], lambda t, q, v: [3.0 * t]),
        pulse=lambda: of_run(
            slide(0.0, 3.0), [0.0], [0.0], [0.0, 1.0], lambda t, q, v: [9.0 * np.exp(-90.0 * (t - 0.5) ** 2)]
        ),
        pushed=lambda: of_run(
            slide(0.0, 3.0), [0.0], [0.0], [0.0, 0.9], external=lambda t, q, v: {"block": [8 * t, 0, 0, 0, 0, 0]}
        ),
        plastic=lambda: of_run(stopped, [0.1], [-0.8], times, stops=True),
        bounces=lambda: of_run(stopped, [0.1], [1.6], times, stops=True, restitution=0.6),
        falls=lambda: of_run(falling, [0.2], [0.0], [0.0, 0.5, 0.8], stops=True, restitution=0.5),
        elastic=lambda: of_run(falling, [0.1], [0.0], [0.0, 0.5], stops=True, restitution=1.0),
        lifted=lambda: of_run(falling, [0.0], [0.0], [0.0, 1.0, 1.5], lambda t, q, v: [19.62 * t], stops=True),
        no_stops=lambda: of_run(stopped, [0.1], [1.6], [0.0, 0.3]),
        beyond=lambda: of_run(stopped, [0.21], [0.0], times, stops=True),
        wrong_at_once=lambda: [
            tried(lambda given=given: slippery.simulate([0.0], [0.0], [0.0], **given))
            for given in ({"tau": [np.nan]}, {"external": {"none": np.zeros(6)}}, {"external": {"block": [1.0]}})
        ],
        # When it stops is chance, of steps across jumps.
        chatters=lambda: (
            "more than 60 changes between sticking, slipping and stops within 1e-06 s."
            in tried(
                lambda: slide(0.0, 0.5).simulate(
                    [0.0], [0.0], [0.0, 1e-3], lambda t, q, v: [3.0 if v[0] == 0.0 else -3.0 * np.sign(v[0])], atol=1e-5
                )
            )[1]
        ),
        into=lambda: stopped.forward_dynamics([0.2], [0.1], stops=True),
        at_rest=lambda: contact_of(stopped.forward_dynamics([0.2], [0.0], [30.0], stops=True)),
        at_low=lambda: contact_of(stopped.forward_dynamics([-0.05], [0.0], [-30.0], stops=True)),
        leaves=lambda: contact_of(stopped.forward_dynamics([0.2], [-0.1], [30.0], stops=True)),
        near=lambda: contact_of(stopped.forward_dynamics([0.2 - 0.9e-9], [0.0], [30.0], stops=True)),
        nearly=lambda: contact_of(stopped.forward_dynamics([0.2 - 1.2e-9], [0.0], [30.0], stops=True)),
        slow=lambda: contact_of(rough.forward_dynamics([0.0], [0.9e-9])),
        not_so_slow=lambda: contact_of(rough.forward_dynamics([0.0], [1.2e-9])),
        held=lambda: of_forces(rough.inverse_dynamics([0.0], actuated=["slide"])),
        held_alone=lambda: of_forces(rough.inverse_dynamics([0.0], actuated=[])),
        slips_alone=lambda: of_forces(slippery.inverse_dynamics([0.0], actuated=[])),
        starts=lambda: of_forces(rough.inverse_dynamics([0.0], [0.0], [0.3], actuated=["slide"])),
        derived=lambda: rough.forward_dynamics_derivatives([0.0]),
        derived_moving=lambda: [
            rough.forward_dynamics_derivatives([0.0], [0.3]).a_q,
            rough.inverse_dynamics_derivatives([0.0], [0.3], actuated=["slide"]).tau_a,
        ],
    )


def loops():
    """Loops that rub, hit their stops or are blocked."""
    free, hits = ClosedChain.from_mjcf(CRANK.format(crank="", slider="")), {}
    for name, crank, low in (
        ("slider", "", 'range="-1 -0.03"'),
        ("crank", 'range="-0.5 1.2"', ""),
        ("both", 'range="-2 1.2"', 'range="-1 -0.04"'),
    ):
        hits[name] = ClosedChain.from_mjcf(CRANK.format(crank=crank, slider=low))

    blocked = ClosedChain.from_mjcf(CRANK.format(crank="", slider='range="0 1"'))

    def start(chain, angle, speed):
        q = chain.close([angle, -angle, 0.0], hold=["crank"])
        return q, chain.dependent_motion(q, ["crank"], [speed])[0]

    bar = four_bar()
    rubs = with_friction(bar.chain(), [0.5, 0.3, 0.8])
    rubs.model.gravity.linear = np.array([0.4, -9.0, 0.0])
    at_stop = hits["both"].close([1.2, -1.0, -0.1], hold=["crank"])
    return all_tried(
        free=lambda: of_run(free, *start(free, 0.9, -2.0), [0.0, 0.2, 0.4]),
        slider=lambda: of_run(hits["slider"], *start(hits["slider"], 1.0, -2.0), [0.0, 0.3, 0.6], stops=True),
        slider_bounces=lambda: of_run(
            hits["slider"], *start(hits["slider"], 1.0, -2.0), [0.0, 0.3, 0.6], stops=True, restitution=0.5
        ),
        crank=lambda: of_run(
            hits["crank"], *start(hits["crank"], 0.8, 2.0), [0.0, 0.3, 0.6], stops=True, restitution=0.3
        ),
        both=lambda: of_run(
            hits["both"], *start(hits["both"], 1.0, 3.0), [0.0, 0.2, 0.6], {"crank": 0.4}, stops=True, restitution=0.2
        ),
        rests=lambda: contact_of(hits["both"].forward_dynamics(at_stop, tau={"crank": 2.0}, stops=True)),
        rests_pulled=lambda: contact_of(hits["both"].forward_dynamics(at_stop, tau={"crank": -2.0}, stops=True)),
        blocked=lambda: of_run(blocked, *start(blocked, 0.0, 2.0), [0.0, 0.1], stops=True),
        dead=lambda: of_run(free, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.1]),
        dead_still=lambda: free.forward_dynamics([0.0, 0.0, 0.0]).a,
        rubs=lambda: contact_of(rubs.forward_dynamics(bar.q, tau={"crank_hinge": 6.0})),
        rubs_held=lambda: of_forces(rubs.inverse_dynamics(bar.q)),
        rubs_bound=lambda: of_forces(rubs.inverse_dynamics(bar.q, effort_bounds={"crank_hinge": (1.9, 2.3)})),
        rubs_refused=lambda: of_forces(rubs.inverse_dynamics(bar.q, effort_bounds={"crank_hinge": (-1.0, 1.0)})),
        rubs_brake=lambda: of_forces(rubs.inverse_dynamics(bar.q, actuated=[], reaction_bounds={"tip": (-50.0, 50.0)})),
        rubs_run=lambda: of_run(
            rubs, bar.q, [0.0, 0.0, 0.0], [0.0, 0.1, 0.3], lambda t, q, v: {"crank_hinge": 9.0 - 20.0 * t}
        ),
        rubs_loaded=lambda: of_run(
            loaded("cylindrical loop", 0.9).chain, loaded("cylindrical loop").q, np.zeros(7), [0.0, 0.05]
        ),
    )


def crossings():
    """Flat parallelograms that go on, near singular states, and stiff chains."""
    urdf, closures = flat_parallelogram()
    flat = ClosedChain.from_urdf(urdf, closures)
    windows = parallel_windows(1, "spherical", np.pi / 2, -1.0, np.linspace(0.0, 0.9, 4))
    stiff = crank_rocker()
    stiff.model.damping = np.array([4e3, 30.0, 10.0])
    near = stiff.close([0.7, 0.3, 1.6])

    def damped(pull):
        """A block under a steep damper that a controller makes, from rest."""
        found = slide().simulate([0.0], [0.0], [0.0, 0.4, 1.0], pull, rtol=1e-6, atol=1e-8)
        return [found.q, found.v]

    def beside(angle):
        q = flat.close([angle, -angle, angle])
        return [
            q,
            short(str(flat.mobility(q)).split("singular values up to")[0]),
            *of_forces(flat.inverse_dynamics(q, actuated=["crank_hinge"]), False),
        ]

    def pressed(angle):
        q = flat.close([angle, -angle, angle])
        v = flat.dependent_motion(q, ["crank_hinge"], [1.0])[0]
        return [flat.forward_dynamics(q, v, {"crank_hinge": 1.0}).a, flat.forward_dynamics(q, v).cautions]

    weighed = ClosedChain.from_mjcf(FLAT)

    def weak(angle, tolerance):
        chain = weighed.with_tolerance(tolerance) if tolerance else weighed
        q = chain.close([angle, -angle, angle])
        held = [chain.inverse_dynamics(q, actuated=[name]) for name in ("j", "k")]
        fallen = chain.forward_dynamics(q)
        return [q, [[one.tau, one.multipliers, one.cautions] for one in held], fallen.a, fallen.cautions]

    angles = [(angle, known) for known in (0.0, 1e-7, 1e-5) for angle in (1e-3, 0.01, 0.02, 0.1, 0.5)]
    return all_tried(
        weak=lambda: [tried(lambda one=one: weak(*one)) for one in angles],
        windows=lambda: of_run(windows.chain, windows.q, windows.v, windows.times),
        # A push that begins behind the place, before the loops are as far from it again: no motion goes on as it came.
        windows_pushed=lambda: tried(
            lambda: (
                windows.chain.simulate(
                    windows.q, windows.v, [0.0, 0.8], lambda t, q, v: [0.6 * (t > 0.709947), 0.0, 0.0]
                ).q
            )
        )[0],
        flat=lambda: [tried(lambda angle=angle: beside(angle)) for angle in (1e-1, 1e-3)],
        flat_moving=lambda: [tried(lambda angle=angle: pressed(angle)) for angle in (0.3, 0.05)],
        through=lambda: of_run(flat, *_swing(flat, 0.6, -1.5), [0.0, 0.2, 0.6, 0.8]),
        gimbal=lambda: ClosedChain.from_mjcf(GIMBAL).forward_dynamics([0.3, np.pi / 2, 0.2]).a,
        started_flat=lambda: flat.simulate(np.zeros(3), np.array([1.0, -1.0, 1.0]), [0.0, 0.1]).q,
        # Where steps are large the first efforts of a trial step are 1e17 N.
        pulled=lambda: damped(lambda t, q, v: [100.0 * (t > 0.3) - 1e5 * v[0]]),
        steep=lambda: damped(lambda t, q, v: [5.0 * np.sin(9.0 * t) - 3.0 * np.tanh(1e5 * v[0])]),
        stiff=lambda: of_run(stiff, near, np.zeros(3), [0.0, 0.5, 1.0]),
        stiff_driven=lambda: of_run(
            stiff, near, np.zeros(3), [0.0, 0.3], lambda t, q, v: [50.0 * t, 0.0, 0.0], rtol=1e-6, atol=1e-7
        ),
    )


def _swing(chain, angle, speed):
    q = chain.close([angle, -angle, angle])
    return q, chain.dependent_motion(q, ["crank_hinge"], [speed])[0]


def contacts(name, seeds):
    """Random states in which joints rub, rest at their stops or leave them, and what follows; some are blocked."""
    case, found = loaded(name, 0.6, even=True), []
    for seed in seeds:
        rng, model = np.random.default_rng(seed), case.chain.model.copy()
        for k in range(1, model.njoints):
            at, way = model.idx_qs[k], rng.integers(4)
            if model.nqs[k] == 1 and way < 2:
                limits = model.lowerPositionLimit if way else model.upperPositionLimit
                limits[at] = case.q[at]
            if model.nqs[k] == 1 and rng.random() < 0.4:
                own = model.idx_vs[k]
                model.upperDryFrictionLimit[own] = model.lowerDryFrictionLimit[own] = 0.0
        chain = ClosedChain(model, case.chain.description)
        tau = rng.choice([5.0, 40.0]) * rng.normal(size=model.nv)
        v = chain.project_velocity(case.q, (seed % 3) * 0.5 * rng.normal(size=model.nv))
        still = 0.0 * v
        found.append(tried(lambda: contact_of(chain.forward_dynamics(case.q, still, tau, stops=True))))  # noqa: B023
        found.append(tried(lambda: contact_of(chain.forward_dynamics(case.q, v, tau, stops=True))))  # noqa: B023
        given = {"stops": True, "restitution": 0.3 * (seed % 4)}
        found.append(tried(lambda: of_run(chain, case.q, v, [0.0, 0.02, 0.06], tau, **given)))  # noqa: B023
    return found
