"""Answers of the consistency checks: of designs that pass, and of those that cannot work, as stored."""

import re
from dataclasses import replace

import numpy as np
import pinocchio as pin
from answers import changes, each_of
from asked_events import FLAT
from asked_poses import crank_rocker
from mechanisms import sliders
from places import URDF
from scipy.spatial.transform import Rotation
from singular_poses import POSES

import exo_pin as ep
from exo_pin.chain import ClosedChain, Closure, Closures, Placement
from exo_pin.consistency import Finding, Report, check, check_chain
from exo_pin.device import Brake, GasSpring, LinearSpring, Route, Spring, TableLaw


def load(name):
    return ep.load(URDF / f"{name}.urdf" if (URDF / f"{name}.urdf").exists() else name)


def told(report):
    """What is found, without the digits of rounding errors."""
    rounding = re.compile(r"\d\.\d+e[-+](0[7-9]|1\d)|\binf\b")
    return [(each.name, each.outcome, rounding.sub("(rounding)", each.detail)) for each in report.findings]


def kinds():
    names = (
        "prototype",
        "scenario-one",
        "appendix-d",
        "four-cables",
        "serial-y-x-z",
        "3rps-passive-ball",
        "six-cables",
    )
    return {name: told(load(name).check()) for name in (*names, "spring-support", "dummy-shoulder")} | {
        "preset": told(ep.load("prototype").check())
    }


def spoiled():
    """Wrists that are singular, folded or without mass, of limbs of few kinds, and a robot that is locked or open."""
    muscles, serial, cables = ep.load("prototype"), load("serial-y-x-z"), load("four-cables")
    joints = [drive.joint for drive in serial.device.drives]
    turned = {angle: ep.thesis_rotation(angle, 0, 0, degrees=True) for angle in (90.0, 60.0, 20.0)}
    # From here one of the poses that are looked at is singular.
    turned["to a singular one"] = Rotation.from_rotvec([-0.505805, -0.69539964, -0.5793751])
    neutral = {angle: muscles.geometry.replace(neutral=turn) for angle, turn in turned.items()}
    ways = [Route.over(("universe", at), ("arm", [0.02, 0.0, -0.2])) for at in ([0.3, 0, 0], [0, 0.3, 0])]
    springs = [Spring("top", TableLaw((0.1, 0.35), (1.0, 2.0)), route=ways[0]),
               Spring("cord", LinearSpring(40.0), route=ways[1]),
               Spring("far", TableLaw((2.0, 3.0), (1.0, 2.0)), route=ways[1])]  # fmt: skip
    pairs = [np.array(each)[[0, 0, 2]] for each in (muscles.geometry.base_points, muscles.geometry.platform_points)]
    designs = [
        muscles.replace(geometry=ep.WristGeometry(*pairs, neutral=muscles.geometry.neutral)),
        *(muscles.replace(geometry=each) for each in neutral.values()),
        muscles.replace(arm=None),
        muscles.replace(arm=ep.Arm(2.0, [0.0, 0.0, -0.2])),
        muscles.replace(limbs=[ep.Limb("UPU"), ep.Limb("SPS"), ep.Limb("UPU")]),
        cables.replace(limbs=None),
        serial.replace(drives=()),
        serial.replace(drives=serial.device.drives[:1], brakes=[Brake("hold", joints[1])]),
        serial.replace(springs=springs),
        serial.replace(springs=springs[1:2]),
        serial.replace(springs=[Spring("hinge", TableLaw((-0.4, 0.9), (1.0, 2.0)), joint=name) for name in joints[:2]]),
    ]
    return [told(design.check()) for design in designs] + [
        told(check_chain(serial.chain)), told(check_chain(cables.chain, 1)), told(check(cables.device.as_chain())),
        str(Report("own", (Finding.of("loops", False, "open"), Finding.of("mobility", True, "fits")))),
        Report("own", (Finding("loops", "note", "open"),))._repr_html_(),
        Report("own", (Finding("loops", "note", "open"),)),
    ]  # fmt: skip


def wrong(far=np.inf, gap=0.0, tilt=0.0, tolerance=0.0, length=0.7):
    """Slides whose loop does not close far from zero, is open, or whose Jacobian is wrong, by so much."""

    class Wrong(ClosedChain):
        def close(self, q, **more):
            closed = super().close(q, **more)
            if abs(closed[-1]) > far:
                raise ep.LoopNotClosed(closed, 0.1, 3)
            return closed

        def residual(self, q):
            return super().residual(q) + gap

        def constraint_jacobian(self, q):
            return super().constraint_jacobian(q) + tilt

    slide = sliders(length).chain()
    return Wrong(slide.model, replace(slide.description, tolerance=tolerance))


def heavy(*bodies):
    """A tree of hinges whose bodies have these masses and principal moments."""
    model = pin.Model()
    for k, (mass, *moments) in enumerate(bodies):
        hinge = pin.JointModelRX() if k % 2 else pin.JointModelRZ()
        model.addJoint(k, hinge, pin.SE3(np.eye(3), np.array([0.3, 0.0, 0.1])), f"joint_{k}")
        own = pin.Inertia(1.0, np.array([0.1, 0.2, 0.0]) * (mass > 0.0), np.eye(3))
        own.inertia, own.mass = np.diag(moments), mass
        model.inertias[k + 1] = own
    return ClosedChain(model, Closures("tree"))


def chains():
    """Robots that are open, singular, rounded, beyond their limits or without mass, or whose bodies no body can be."""
    held = crank_rocker().with_closure(
        Closure("rod", "distance", "crank", "universe", Placement((0.5, 0, 0)), distance=3)
    )
    flat, near = ClosedChain.from_mjcf(FLAT), ClosedChain.from_mjcf(FLAT)
    near.model.inertias[3] = pin.Inertia.Zero()
    near.model.referenceConfigurations["qpos0"] = near.close([1e-7, -1e-7, 1e-7])
    fits, none = (1.0, 1.0, 1.0, 1.0), (0.0,) * 4
    robots = [held, flat, near, wrong(far=0.11), crank_rocker('range="-0.1 0.2"')]
    # Loops are closed to 1e-12, and within twenty tolerances, over lengths below 1 m; differences agree to 1.8336e-8.
    robots += [wrong(gap=gap, tolerance=1e-5) for gap in (2.84e-4, 2.87e-4)]
    robots += [wrong(gap=gap, tolerance=1e-5, length=1.3) for gap in (1.95e-4, -2.05e-4)]
    robots += [wrong(gap=gap, tilt=tilt) for gap, tilt in ((0.95e-12, 1.832e-8), (1.1e-12, 1.8355e-8), (0.0, -1e-7))]
    robots += [POSES["kite folded"].chain(digits) for digits in (None, 5)]
    robots += [heavy(fits, (1.0, 1.0, 1.0, most)) for most in (2.0 + 2.2e-9, 2.0 + 1.9e-9, -1.1e-9, -0.9e-9)]
    robots += [
        heavy(none, fits),
        heavy(fits, none),
        heavy(fits, (0.0, 1.0, 1.0, 1.0)),
        heavy(fits, (1.0, -1.0, -1.0, -1.0)),
    ]
    return [told(check_chain(robot)) for robot in robots]


def devices():
    """Devices of which a limb is folded, or whose loops do not close, at all or with the arm hanging."""
    cables, serial = ep.load("four-cables"), load("serial-y-x-z")
    points = [cables.geometry.base_points.copy() for _ in range(2)]
    for own, gap in zip(points, (0.9e-6, 1.1e-6), strict=True):
        own[0] = cables.geometry.neutral.as_matrix() @ cables.geometry.platform_points[0] + np.array([0.0, 0.0, gap])
    folded = [cables.replace(geometry=cables.geometry.replace(base_points=own)) for own in points]
    strut = Spring(
        "strut", TableLaw((0.3, 0.5), (1.0, 2.0)), route=Route.over(("universe", [0, 0, -0.4]), ("arm", [0, 0, -0.2]))
    )
    places = Placement((0.0, 0.0, -0.3)), Placement((0.3, 0.0, 0.0))
    ties = [Closure("tie", "distance", "arm", "universe", *places, distance=size) for size in (0.2, 9.0)]
    tied = [serial.device.replace(chain=serial.chain.with_closure(tie), springs=[strut]) for tie in ties]
    gas = Spring("gas", GasSpring(90.0, 0.55, 0.3), route=strut.route)
    return [told(check(each)) for each in (*folded, *tied, serial.replace(springs=[gas]))]


ASKED = {"kinds": kinds, "spoiled": spoiled, "chains": chains, "devices": devices}
LONGER = {"kinds", "spoiled", "devices", "chains"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
