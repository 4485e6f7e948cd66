"""Textbook singular poses as chains that are closed at q = 0, exact or with their geometry rounded as in a file."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from exo_pin.chain import ClosedChain, Closure, Closures, Placement, Roles

X, Y, Z = np.eye(3)
_JOINTS = {"R": pin.JointModelRZ, "P": pin.JointModelPZ, "S": pin.JointModelSpherical}


class Drawing:
    """Joints, each with the joint before it, its point and direction, and closures; counts are of :data:`POSES`."""

    def __init__(self):
        self.joints, self.cuts, self.driven = [], [], []

    def add(self, parent, kinds, point, *axes, driven=False):
        """A chain of joints at one point; the last one's index."""
        for k, kind in enumerate(kinds):
            axis = np.asarray(axes[k] if k < len(axes) else Z, dtype=float)
            self.joints.append((parent, kind, np.asarray(point, dtype=float), axis / np.linalg.norm(axis)))
            parent = len(self.joints) - 1
            if driven:
                self.driven.append(parent)
        return parent

    def cut(self, kind, one, other, point, axis=Z):
        self.cuts.append((kind, one, other, np.asarray(point, dtype=float), np.asarray(axis, dtype=float)))

    def chain(self, digits=None, seed=0):
        """Turned and moved at random."""
        rng, whole = np.random.default_rng(seed), Rotation.random(random_state=seed)
        shift, model, frames = rng.uniform(-0.2, 0.2, 3), pin.Model(), []

        def frame(point, axis):
            about = Rotation.align_vectors([axis], [Z])[0] * Rotation.from_euler("z", rng.uniform(-3, 3))
            return pin.SE3((whole * about).as_matrix(), whole.apply(point) + shift)

        def rounded(pose):
            place, angles = pose.translation, Rotation.from_matrix(pose.rotation).as_euler("xyz")
            if digits is not None:
                place, angles = np.round(place, digits), np.round(angles, digits)
            return pin.SE3(Rotation.from_euler("xyz", angles).as_matrix(), place)

        def within(pose, link):
            return pose if link < 0 else frames[link].actInv(pose)

        for k, (parent, kind, point, axis) in enumerate(self.joints):
            frames.append(frame(point, axis))
            joint = model.addJoint(parent + 1, _JOINTS[kind](), rounded(within(frames[k], parent)), f"joint_{k}")
            model.addFrame(pin.Frame(f"link_{k}", joint, 0, pin.SE3.Identity(), pin.FrameType.BODY))
            model.appendBodyToJoint(joint, pin.Inertia(1.0, np.zeros(3), 1e-2 * np.eye(3)), pin.SE3.Identity())
        closures = []
        for k, (kind, one, other, point, axis) in enumerate(self.cuts):
            pose, places = frame(point, axis), []
            for link in (one, other):
                local = rounded(within(pose, link))
                turn = Rotation.from_matrix(local.rotation).as_quat()
                places.append(Placement(tuple(local.translation), tuple(turn)))
            names = ("universe" if link < 0 else f"link_{link}" for link in (one, other))
            closures.append(Closure(f"cut_{k}", kind, *names, *places))
        roles = Roles(actuated=tuple(f"joint_{k}" for k in self.driven))
        described = Closures("pose", closures=tuple(closures), roles=roles)
        chain = ClosedChain(model, described)
        return chain if digits is None else chain.with_tolerance(0.5 * 10.0**-digits)


def _plane(points, driven=(0,), last="revolute"):
    """A loop of hinges with parallel axes, cut at its last point."""
    drawing = Drawing()
    for k, point in enumerate(points[:-1]):
        drawing.add(k - 1, "R", (*point, 0.0), Z, driven=k in driven)
    drawing.cut(last, len(points) - 2, -1, (*points[-1], 0.0))
    return drawing


def _ball_loop(axes, driven=(0,)):
    """A loop of hinges whose axes meet in one point, cut at the last."""
    drawing = Drawing()
    for k, axis in enumerate(axes[:-1]):
        drawing.add(k - 1, "R", 0.2 * np.asarray(axis), axis, driven=k in driven)
    drawing.cut("revolute", len(axes) - 2, -1, 0.2 * np.asarray(axes[-1]), axes[-1])
    return drawing


def _planar_platform(base, tips, elbows=None):
    """Three limbs R-P-R, slides driven, or R-R-R with elbows, first hinges driven, onto a platform in the plane."""
    drawing = Drawing()
    for i, (foot, tip) in enumerate(zip(base, tips, strict=True)):
        foot, tip = np.array([*foot, 0.0]), np.array([*tip, 0.0])
        if elbows is None:
            leg = drawing.add(-1, "R", foot)
            leg = drawing.add(leg, "P", foot, tip - foot, driven=True)
        else:
            leg = drawing.add(-1, "R", foot, driven=True)
            leg = drawing.add(leg, "R", (*elbows[i], 0.0))
        if i:
            drawing.cut("revolute", leg, platform, tip)  # noqa: F821
        else:
            platform = drawing.add(leg, "R", tip)  # noqa: F841
    return drawing


def _legs(base, tips, kinds="RRP", axes=None, end="S"):
    """Legs of hinges and a driven slide from a base to a platform, which hangs on the first one."""
    drawing, platform = Drawing(), None
    for i, (foot, tip) in enumerate(zip(np.array(base, float), np.array(tips, float), strict=True)):
        along = tip - foot
        first, second = (np.cross(along, X + 0.3 * Y), None) if axes is None else axes(i, along)
        first = first / np.linalg.norm(first)
        second = np.cross(along, first) if second is None else second
        leg = drawing.add(-1, "RR" if kinds == "RRP" else "R", foot, first, second)
        leg = drawing.add(leg, "P", foot, along, driven=True)
        if end == "U":
            if platform is None:
                platform = drawing.add(leg, "RR", tip, second, first)
            else:
                leg = drawing.add(leg, "R", tip, second)
                drawing.cut("revolute", leg, platform, tip, first)
        elif platform is None:
            platform = drawing.add(leg, "S", tip, along)
        else:
            drawing.cut("spherical", leg, platform, tip)
    return drawing


def _circle(radius, degrees, height=0.0):
    angles = np.deg2rad(degrees)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(len(angles), height)])


def _tangential(base):
    def axes(i, along):
        first = np.cross(Z, base[i])
        return first, np.cross(along, first)

    return axes


def _radial(base):
    def axes(i, along):
        return base[i] * [1, 1, 0], np.cross(along, base[i] * [1, 1, 0])

    return axes


def _sarrus(height):
    """Two pairs of hinged plates; flat, the platform may turn."""
    drawing, out = Drawing(), 0.25
    leg = drawing.add(-1, "R", (0.1, 0, 0), Y, driven=True)
    leg = drawing.add(leg, "R", (out, 0, height / 2), Y)
    platform = drawing.add(leg, "R", (0.1, 0, height), Y)
    leg = drawing.add(-1, "R", (0, 0.1, 0), X)
    leg = drawing.add(leg, "R", (0, out, height / 2), X)
    drawing.cut("revolute", leg, platform, (0, 0.1, height), X)
    return drawing


def _spherical_3rrr(elbows, tips):
    """First hinges on the axes of a cube, driven; all axes meet in one point."""
    drawing, platform = Drawing(), None
    for k, (elbow, tip) in enumerate(zip(elbows, tips, strict=True)):
        leg = drawing.add(-1, "R", 0.2 * np.eye(3)[k], np.eye(3)[k], driven=True)
        leg = drawing.add(leg, "R", 0.15 * np.asarray(elbow), elbow)
        if platform is None:
            platform = drawing.add(leg, "R", 0.1 * np.asarray(tip), tip)
        else:
            drawing.cut("revolute", leg, platform, 0.1 * np.asarray(tip), tip)
    return drawing


def _bricard():
    """Six hinges along six edges of a cube, each perpendicular to both edges that meet there: one freedom."""
    corners = 0.3 * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1], [0, 0, 1]])
    edges = np.roll(corners, -1, axis=0) - corners
    drawing = Drawing()
    for k in range(5):
        drawing.add(k - 1, "R", corners[k], np.cross(edges[k - 1], edges[k]), driven=k == 0)
    drawing.cut("revolute", 4, -1, corners[5], np.cross(edges[4], edges[5]))
    return drawing


def _gough(turn, height=0.5):
    """Pairs of feet 40 degrees apart, of tips between them: regular at home."""
    pairs = np.array([0, 120, 240])
    feet, tips = (np.ravel(pairs[:, None] + np.array([-half, half])) for half in (20, 40))
    return _legs(_circle(0.3, feet), _circle(0.2, tips + turn, height))


def _five_bar():
    """Both cranks driven, their bars in one line."""
    drawing = Drawing()
    left = drawing.add(drawing.add(-1, "R", (0, 0, 0), driven=True), "R", (0.1, 0.2, 0))
    right = drawing.add(drawing.add(-1, "R", (0.5, 0, 0), driven=True), "R", (0.4, 0.2, 0))
    drawing.cut("revolute", left, right, (0.25, 0.2, 0))
    return drawing


def _slider_crank():
    """The slide driven, crank and rod in its line."""
    drawing = Drawing()
    rod = drawing.add(drawing.add(-1, "R", (0, 0, 0)), "R", (0.1, 0, 0))
    slide = drawing.add(-1, "P", (0.4, 0, 0), X, driven=True)
    drawing.cut("revolute", rod, slide, (0.4, 0, 0))
    return drawing


def _double_parallelogram():
    drawing = Drawing()
    bar = drawing.add(drawing.add(-1, "R", (0, 0, 0), driven=True), "R", (0.1, 0, 0))
    for x in (0.25, 0.4):
        crank = drawing.add(-1, "R", (x, 0, 0))
        drawing.cut("revolute", crank, bar, (x + 0.1, 0, 0))
    return drawing


_T = np.array([0, 120, 240])
_FEET, _NEAR_TIPS = _circle(0.3, _T), _circle(0.12, _T, 0.4)
_STAR = _circle(1, _T)[:, :2]
_PLATE, _ARMS = ([v / np.linalg.norm(v) for v in np.eye(3) + more] for more in (1.5, 0.4))
#: Names to drawings of singular poses, and of regular ones.
POSES = {
    "parallelogram at its change point": _plane([(0, 0), (0.1, 0), (0.4, 0), (0.3, 0)]),
    "kite folded": _plane([(0, 0), (0.2, 0), (0.5, 0), (0.3, 0)]),
    "four-bar at its change point": _plane([(0, 0), (0.1, 0), (0.35, 0), (0.15, 0)]),
    "straight two-bar": _plane([(0, 0), (0.2, 0), (0.5, 0)]),
    "hexagon on a line": _plane([(0, 0), (0.1, 0), (0.3, 0), (0.6, 0), (0.5, 0), (0.2, 0)], driven=(0, 1, 2)),
    "crank at the dead point": _plane([(0, 0), (0.05, 0.1), (0.25, 0.1), (0.4, 0.1)]),
    "slider-crank in line": _slider_crank(),
    "five-bar, distal bars in line": _five_bar(),
    "flat double parallelogram": _double_parallelogram(),
    "3-RPR, limbs concurrent": _planar_platform(0.5 * _STAR, 0.1 * _STAR),
    "3-RPR, limbs parallel": _planar_platform([(0, 0), (0.2, 0), (0.5, 0)], [(0, 0.4), (0.2, 0.3), (0.5, 0.35)]),
    "3-RRR, distal links concurrent": _planar_platform(0.5 * _STAR, 0.1 * _STAR, 0.3 * _STAR),
    "Sarrus flat": _sarrus(0.0),
    "spherical two-bar in a plane": _ball_loop([Rotation.from_rotvec(angle * X).apply(Z) for angle in (0.0, 0.5, 1.3)]),
    "spherical four-bar at its change point": _ball_loop(
        [Rotation.from_rotvec(angle * X).apply(Z) for angle in (0.0, 0.5, 1.3, 0.8)]
    ),
    "spherical 3-RRR, planes meet": _spherical_3rrr(_ARMS, _PLATE),
    "3-UPU at home": _legs(_FEET, _NEAR_TIPS, axes=_radial(_FEET), end="U"),
    "3-RPS, legs in the platform": _legs(
        _circle(0.4, _T), _circle(0.15, _T), kinds="RP", axes=_tangential(_circle(0.4, _T))
    ),
    "Fichter's turn of 90 degrees": _gough(90.0),
    "Gough, platform in the base": _gough(20.0, height=0.0),
}
REGULAR = {
    "Bricard on a cube": _bricard(),
    "Sarrus": _sarrus(0.2),
    "four-bar": _plane([(0, 0), (0.06, 0.11), (0.31, 0.17), (0.3, 0)]),
    "3-UPU, other axes": _legs(_FEET, _NEAR_TIPS, axes=_tangential(_FEET), end="U"),
    "Gough": _gough(0.0),
}
