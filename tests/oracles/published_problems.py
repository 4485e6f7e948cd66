"""Multibody problems that others published, as chains, each with values that another program or a closed form gives.

A01 to A05 are those of the IFToMM library of benchmarks (lim.ii.udc.es/mbsbenchmark), Andrews' squeezer with the data
of the IVP test set (Hairer and Wanner; archimede.uniba.it/~testset). SI units, g = 9.81. Hinges are closed by points,
and springs lie in massless slides, so that planar loops have redundant rows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin
import scipy

import exo_pin as ep
from exo_pin.chain import Closure, Closures

G = 9.81


@dataclass(frozen=True)
class Problem:
    """A chain, the start of its motion, and what is known of it.

    ``values`` are shape (count, n) at ``times``, of ``measured(chain, q)``, m or rad; ``efforts`` of forward_dynamics.
    """

    chain: ep.ClosedChain
    q: np.ndarray
    v: np.ndarray
    times: np.ndarray
    values: np.ndarray
    measured: Callable[[ep.ClosedChain, np.ndarray], np.ndarray]
    efforts: dict[str, float] = field(default_factory=dict)

    def run(self):
        """The simulation, and its largest error, m or rad."""
        start = self.times[0] > 0.0
        times = np.concatenate([[0.0], self.times]) if start else self.times
        run = self.chain.simulate(self.q, self.v, times, self.efforts or None)
        found = np.array([self.measured(self.chain, q) for q in run.q[int(start) :]])
        return run, float(np.abs(found - self.values).max())


def _chain(bodies: str, gravity: str = "0 0 -9.81", sites: str = "") -> ep.ClosedChain:
    """Of an MJCF; what MuJoCo cannot have is put in behind it: links of springs lose their inertia."""
    chain = ep.ClosedChain.from_mjcf(
        f'<mujoco><option gravity="{gravity}"/><worldbody>{sites}{bodies}</worldbody></mujoco>'
    )
    model = chain.model.copy()
    for index, name in enumerate(model.names):
        if "spring" in str(name):
            model.inertias[index] = pin.Inertia.Zero()
    return ep.ClosedChain(model, chain.description)


def _named(chain: ep.ClosedChain, values: dict[str, float]) -> np.ndarray:
    return np.array([values.get(str(name), 0.0) for name in list(chain.model.names)[1:]])


def _coordinates(*joints: str):
    """What is measured: the coordinates of joints."""
    return lambda chain, q: q[[chain.model.idx_qs[chain.model.getJointId(name)] for name in joints]]


def _leg(name: str, at: str, axis: str, spring: str) -> str:
    """A massless slide with a spring, on a hinge, up to the site ``name_end``."""
    inertial = '<inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>'
    return (
        f'<body pos="{at}"><joint name="{name}_turn" axis="{axis}"/>{inertial}'
        f'<body><joint name="{name}" type="slide" axis="1 0 0" {spring}/>{inertial}'
        f'<site name="{name}_end"/></body></body>'
    )


def pendulum() -> Problem:
    """A01: a point of 1 kg, 1 m from its hinge, from the horizontal at rest; closed form by Jacobi's functions."""
    model = pin.Model()
    model.addJoint(0, pin.JointModelRevoluteUnaligned(-np.eye(3)[1]), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(1, pin.Inertia(1.0, np.eye(3)[0], np.zeros((3, 3))), pin.SE3.Identity())
    chain = ep.ClosedChain(model, Closures("pendulum"))
    times = np.linspace(0.0, 10.0, 101)
    _, cn, dn, _ = scipy.special.ellipj(np.sqrt(G) * times, 0.5)
    hanging = 2.0 * np.arcsin(np.sqrt(0.5) * cn / dn)
    place = np.column_stack([-np.sin(hanging), -np.cos(hanging)])
    return Problem(
        chain,
        np.array([np.pi]),
        np.zeros(1),
        times,
        place,
        lambda _, q: np.array([np.cos(q[0]), np.sin(q[0])]),
    )


def windows(N: int, kind: str = "spherical") -> ep.ClosedChain:
    """A02: N windows of 2 N + 1 bars of 1 m and 1 kg."""
    crank = '<inertial mass="1" pos="0 0 .5" diaginertia="0.08333333333333333 0.08333333333333333 1e-4"/>'
    bar = '<inertial mass="1" pos=".5 0 0" diaginertia="1e-4 0.08333333333333333 0.08333333333333333"/>'
    bodies = ""
    for k in range(N + 1):
        inner = f'<body pos="0 0 1"><joint name="b{k}" axis="0 1 0"/>{bar}<site name="end{k}" pos="1 0 0"/></body>'
        bodies += (
            f'<body pos="{k} 0 0"><joint name="c{k}" axis="0 1 0"/>{crank}<site name="top{k}" pos="0 0 1"/>'
            f"{inner if k < N else ''}</body>"
        )
    chain = _chain(bodies)
    axis = {"axis": (0, 1, 0)} if kind == "revolute" else {}
    for k in range(N):
        chain = chain.with_closure(Closure(f"loop{k}", kind, f"end{k}", f"top{k + 1}", **axis))
    return chain


def parallel_windows(N: int, kind: str, start: float, speed: float, times: np.ndarray) -> Problem:
    """A02 with all cranks at an angle from the x axis, rad, and a speed, rad/s; measured is the first crank's end.

    All cranks turn alike: φ'' = -c cos φ, c = 3 g (3 N + 1) / (2 (4 N + 1)).
    """
    chain = windows(N, kind)
    cranks = np.array([1.0 if str(name)[0] == "c" else -1.0 for name in list(chain.model.names)[1:]])
    c = 3 * G * (3 * N + 1) / (2 * (4 * N + 1))
    exact = scipy.integrate.solve_ivp(
        lambda t, y: [y[1], -c * np.cos(y[0])], times[[0, -1]], [start, speed], "DOP853", times, rtol=1e-12, atol=1e-13
    ).y[0]
    place = np.column_stack([np.cos(exact), np.sin(exact)])
    return Problem(
        chain,
        (np.pi / 2 - start) * cranks,
        -speed * cranks,
        times,
        place,
        lambda _, q: np.array([np.sin(q[0]), np.cos(q[0])]),
    )


def squeezer() -> Problem:
    """A03, Andrews' squeezer: seven bodies, a spring of 4530 N/m, 0.033 N m at the crank, from rest, 0.03 s."""

    def body(at, joint, mass, inertia, com, inside):
        moments = f"{inertia / 2} {inertia / 2} {inertia}"
        return (
            f'<body pos="{at}"><joint name="{joint}" axis="0 0 1"/>'
            f'<inertial mass="{mass}" pos="{com}" diaginertia="{moments}"/>{inside}</body>'
        )

    def site(name, at):
        return f'<site name="{name}" pos="{at}"/>'

    rod = body(".007 0 0", "theta", 0.00365, 4.41e-7, "-.0115 0 0", site("E2", "-.028 0 0"))
    bodies = body("0 0 0", "beta", 0.04325, 2.194e-6, ".00092 0 0", rod)
    bodies += body(
        "-.03635 .03273 0",
        "gamma",
        0.02373,
        5.255e-6,
        ".01043 -.01874 0",
        site("E3", "0 -.035 0") + site("D", ".02 -.018 0"),
    )
    inner = body(".04 0 0", "phi", 0.00706, 5.667e-7, "0 -.00579 0", site("E4", "0 -.02 0"))
    bodies += body("-.06934 -.00227 0", "delta", 0.0705, 1.169e-5, ".02308 .00916 0", inner)
    inner = body("0 -.04 0", "omega", 0.00706, 5.667e-7, ".00579 0 0", site("E6", ".02 0 0"))
    bodies += body("-.06934 -.00227 0", "epsilon", 0.05498, 1.912e-5, "-.00449 -.01228 0", inner)
    bodies += _leg("spring", ".014 .072 0", "0 0 1", 'stiffness="4530" springref=".07785"')
    chain = _chain(bodies, "0 0 0")
    for end in ("E3", "E4", "E6"):
        chain = chain.with_closure(Closure(end, "spherical", "E2", end))
    chain = chain.with_closure(Closure("D", "spherical", "spring_end", "D"))
    joints = ("beta", "theta", "gamma", "phi", "delta", "omega", "epsilon")
    first = (-0.0617138900142764, 0.0, 0.4552798191630704, 0.2226683901658859)
    first += (0.4873649795438426, -0.2226683901658859, 1.230547444549821)
    gamma = first[2]
    # From C to D.
    x = -0.03635 + 0.02 * np.cos(gamma) + 0.018 * np.sin(gamma) - 0.014
    y = 0.03273 + 0.02 * np.sin(gamma) - 0.018 * np.cos(gamma) - 0.072
    q = _named(
        chain, dict(zip(joints, first, strict=True)) | {"spring_turn": np.arctan2(y, x), "spring": np.hypot(x, y)}
    )
    last = (15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948)
    last += (0.5244099658805304, 0.5347301163226948, 1.048080741042263)
    return Problem(
        chain, q, np.zeros(len(q)), np.array([0.03]), np.array([last]), _coordinates(*joints), {"beta": 0.033}
    )


#: A04: the point between second and third bar at 1, 2, 4 and 8 s, m, of a section of 0.1 m.
BRICARD = (
    (0.274481, -0.886708, -0.462330),
    (-0.778135, -0.980353, -0.197253),
    (0.283551, -0.888023, -0.459799),
    (-0.764353, -0.978154, -0.207882),
)


def bricard() -> Problem:
    """A04: six hinges with five bars of 1 kg, along the edges of a cube, fall from rest along -y; one freedom."""
    points = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], dtype=float)
    axes = ("0 1 0", "0 0 1", "1 0 0", "0 1 0", "0 0 1")
    bodies = '<site name="last"/>'
    for k in reversed(range(5)):
        along = points[k + 1] - points[k]
        moments = " ".join(f"{m:.17g}" for m in np.where(along != 0.0, 0.02 / 12, 1.01 / 12))
        at, middle = (" ".join(map(str, p)) for p in (points[k] - points[max(k - 1, 0)], along / 2))
        end = f'<site name="end" pos="{" ".join(map(str, along))}"/>' if k == 4 else f'<site name="P{k}"/>{bodies}'
        bodies = (
            f'<body name="bar{k}" pos="{at}"><joint name="hinge{k}" axis="{axes[k]}"/>'
            f'<inertial mass="1" pos="{middle}" diaginertia="{moments}"/>{end}</body>'
        )
    chain = _chain(bodies, "0 -9.81 0", '<site name="ground" pos="0 0 1"/>')
    chain = chain.with_closure(Closure("hinge5", "revolute", "end", "ground", axis=(1, 0, 0)))
    return Problem(
        chain,
        np.zeros(5),
        np.zeros(5),
        np.array([1.0, 2.0, 4.0, 8.0]),
        np.array(BRICARD),
        lambda chain, q: chain.placement(q, "P2").translation,
    )


def governor() -> Problem:
    """A05, the flyball governor: couplers are springs with a damping over inertia of thousands per second."""
    moments = (1e-4 + 1.0) * 0.3 / 12.0, 0.3 * 2e-4 / 12.0
    out, down = np.cos(np.radians(30)), np.sin(np.radians(30))
    legs, rods = "", ""
    spring = 'stiffness="8e5" springref=".5" damping="4e4"'
    for side, name in ((1, "right"), (-1, "left")):
        # With its axis turned by the side both rods have the same coordinate: their angle below the horizontal.
        legs += _leg(f"{name}_spring", f"{0.05 * side} 0 0", f"0 {-side} 0", spring.replace(".5", f"{0.5 * side}"))
        rods += (
            f'<body pos="{0.05 * side} 0 1"><joint name="{name}" axis="0 {side} 0"/>'
            f'<inertial mass="5.3" pos="{side * (0.15 + 5) / 5.3} 0 0" '
            f'diaginertia="{moments[1]} {(joined := moments[0] + 0.3 * 5 / 5.3 * 0.25)} {joined}"/>'
            f'<site name="{name}_middle" pos="{0.5 * side} 0 0"/></body>'
        )
    chain = _chain(
        '<body><joint name="shaft" axis="0 0 1"/>'
        f'<inertial mass=".3" pos="0 0 .5" diaginertia="{moments[0]} {moments[0]} {moments[1]}"/>{rods}'
        '<body><joint name="slider" type="slide" axis="0 0 1"/>'
        f'<inertial mass="3" pos="0 0 0" diaginertia=".005 .005 .005"/>{legs}</body></body>'
    )
    for name in ("right", "left"):
        chain = chain.with_closure(Closure(name + "_pin", "spherical", f"{name}_spring_end", f"{name}_middle"))
    rise = np.arctan2(0.5 * (1 - down), 0.5 * out)
    values = {"slider": 0.5}
    for side, name in ((1, "right"), (-1, "left")):
        values |= {name: np.radians(30), f"{name}_spring_turn": rise, f"{name}_spring": 0.5 * side}
    return Problem(
        chain,
        _named(chain, values),
        _named(chain, {"shaft": 2 * np.pi}),
        np.array([0.5, 1.0, 2.0, 5.0, 10.0]),
        np.array([0.743249, 0.501421, 0.505909, 0.535563, 0.619623])[:, None],
        _coordinates("slider"),
    )


#: Ground, crank, coupler, rocker, m; stiffness, N/m, and rest length, m, of the spring over the diagonal.
BARS, STIFFNESS, REST = (2.2, 1.0, 3.0, 2.5), 50.0, 1.5


def diagonal_spring() -> Problem:
    """A four-bar of 1 kg/m with a spring from the crank's end to the rocker's hinge; from rest, 10 s.

    The reference has the crank's angle φ alone: I φ'' + I' φ'² / 2 + V' = 0, I and V in closed form, their derivatives
    by complex steps, integrated at 1e-13.
    """
    ground, crank, coupler, rocker = BARS

    def bar(length, at, joint, inside):
        moment = length**3 / 12
        return (
            f'<body pos="{at}"><joint name="{joint}" axis="0 -1 0"/>'
            f'<inertial mass="{length}" pos="{length / 2} 0 0" diaginertia="{moment / 2} {moment} {moment}"/>'
            f'{inside}<site name="{joint}_end" pos="{length} 0 0"/></body>'
        )

    spring = _leg("spring", f"{ground} 0 0", "0 -1 0", f'stiffness="{STIFFNESS}" springref="{REST}"')
    chain = _chain(
        bar(crank, "0 0 0", "crank", bar(coupler, f"{crank} 0 0", "coupler", ""))
        + bar(rocker, f"{ground} 0 0", "rocker", "")
        + spring
    )
    chain = chain.with_closure(Closure("C", "spherical", "coupler_end", "rocker_end"))
    chain = chain.with_closure(Closure("B", "spherical", "spring_end", "crank_end"))
    start = 1.0
    B, C, _ = _four_bar(start)
    turn, far = np.arctan2(*(C - B)[::-1]), B - [ground, 0.0]
    q = _named(
        chain,
        {
            "crank": start,
            "coupler": turn - start,
            "rocker": np.arctan2(*(C - [ground, 0.0])[::-1]),
            "spring_turn": np.arctan2(*far[::-1]),
            "spring": np.hypot(*far),
        },
    )

    def rate(_, y):
        step = 1e-30
        inertia, potential = _crank_energy(y[0] + step * 1j)
        slope, force = inertia.imag / step, potential.imag / step
        return [y[1], -(0.5 * slope * y[1] ** 2 + force) / inertia.real]

    times = np.linspace(0.0, 10.0, 101)
    exact = scipy.integrate.solve_ivp(rate, (0.0, 10.0), [start, 0.0], "DOP853", times, rtol=1e-13, atol=1e-14).y[0]
    return Problem(chain, q, np.zeros(len(q)), times, exact[:, None], _coordinates("crank"))


def _four_bar(angle):
    """Ends of crank and rocker, shape (2,), and mass-weighted rates by the crank's angle; complex angles, too."""
    ground, crank, coupler, rocker = BARS
    B = crank * np.array([np.cos(angle), np.sin(angle)])
    across = np.array([ground, 0.0]) - B
    d = np.sqrt(across @ across)
    along = (coupler**2 - rocker**2 + d**2) / (2 * d)
    u = across / d
    C = B + along * u + np.sqrt(coupler**2 - along**2) * np.array([-u[1], u[0]])
    near, far, moved = C - B, C - [ground, 0.0], np.array([-B[1], B[0]])
    turned = far[1] * near[0] - far[0] * near[1]
    return B, C, (moved, -(moved @ far) / turned, -(moved @ near) / turned)


def _crank_energy(angle):
    """Inertia at the crank, kg m², and potential energy, J."""
    ground, crank, coupler, rocker = BARS
    B, C, (moved, second, third) = _four_bar(angle)
    near = C - B
    middle = moved + 0.5 * second * np.array([-near[1], near[0]])
    inertia = crank**3 / 3 + coupler * (middle @ middle) + coupler**3 / 12 * second**2 + rocker**3 / 3 * third**2
    away = B - [ground, 0.0]
    stretch = np.sqrt(away @ away) - REST
    weight = G * (crank * B[1] / 2 + coupler * (B[1] + C[1]) / 2 + rocker * C[1] / 2)
    return inertia, weight + 0.5 * STIFFNESS * stretch**2
