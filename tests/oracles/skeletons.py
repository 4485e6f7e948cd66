"""One physical mechanism as different chains: cut at any joints, hung from any body, joints told from either side."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from exchanged_closures import exchanged

from exo_pin.chain import ClosedChain, Closure, Closures, Placement, Roles


@dataclass(frozen=True)
class Joint:
    """A hinge or ball joint between two bodies at a point; the axis is of a hinge."""

    one: str
    other: str
    point: tuple[float, float, float]
    axis: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Skeleton:
    """Bodies as they stand at rest, all with axes parallel to the world's: name to (mass, centre, inertia about it).

    The body "world" stands still and has no mass.
    """

    bodies: dict
    joints: dict

    def chain(self, cut, root="world", reverse=(), order=1, actuated=()):
        """The chain that is opened at the joints ``cut`` and hangs from ``root``, by a free flight if it moves.

        ``reverse``: closures told from the other side; ``order`` -1: closures in the opposite order.
        """
        model = pin.Model()
        at, places = {root: 0}, {"world": np.zeros(3)}
        if root != "world":
            centre = np.asarray(self.bodies[root][1])
            at[root] = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3(np.eye(3), centre), "flight")
            places[root] = centre
            self._fill(model, root, at, places)
        left = {name: joint for name, joint in self.joints.items() if name not in cut}
        while left:
            name, joint = next(item for item in left.items() if {item[1].one, item[1].other} & set(at))
            del left[name]
            parent, child = (joint.one, joint.other) if joint.one in at else (joint.other, joint.one)
            assert child not in at, f"{name} closes a loop"
            assert child != "world", f"{name} hangs the world on a body"
            point = np.asarray(joint.point, dtype=float)
            kind = pin.JointModelSpherical() if joint.axis is None else pin.JointModelRevoluteUnaligned(*joint.axis)
            at[child] = model.addJoint(at[parent], kind, pin.SE3(np.eye(3), point - places[parent]), name)
            model.addFrame(pin.Frame(name, at[child], pin.SE3.Identity(), pin.FrameType.JOINT))
            places[child] = point
            self._fill(model, child, at, places)
        model.gravity.linear = np.array([0.5, -9.0, -3.0])
        closures = []
        for name in cut[::order]:
            joint = self.joints[name]
            frames = ["universe" if body == "world" else body for body in (joint.one, joint.other)]
            shifts = [np.asarray(joint.point) - places[body] for body in (joint.one, joint.other)]
            ends = [Placement(tuple(shift.tolist())) for shift in shifts]
            kind = "spherical" if joint.axis is None else "revolute"
            closure = Closure(name, kind, *frames, *ends, joint.axis)
            closures.append(exchanged(closure) if name in reverse else closure)
        roles = Roles(actuated=tuple(actuated))
        return ClosedChain(model, Closures("skeleton", closures=tuple(closures), roles=roles))

    def _fill(self, model, body, at, places):
        mass, centre, inertia = self.bodies[body]
        own = pin.Inertia(mass, np.asarray(centre, dtype=float) - places[body], np.asarray(inertia, dtype=float))
        model.appendBodyToJoint(at[body], own, pin.SE3.Identity())
        model.addFrame(pin.Frame(body, at[body], pin.SE3.Identity(), pin.FrameType.BODY))

    def sign(self, chain, joint):
        """1 if the chain's coordinate of a hinge turns ``other`` against ``one``, -1 if it is told the other way."""
        child = int(chain.model.getJointId(joint))
        return (
            1.0 if chain.model.frames[chain.model.getFrameId(self.joints[joint].other)].parentJoint == child else -1.0
        )


def thin_rod(start, end, mass):
    """Mass, centre and inertia of a rod, a little thick."""
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    along = end - start
    inertia = mass / 12 * (along @ along * np.eye(3) - np.outer(along, along)) + 1e-4 * np.eye(3)
    return mass, (start + end) / 2, inertia


def four_bar_skeleton(ball=None):
    """A four-bar of hinges about z at A (ground, crank), B, C and D (rocker, ground); ``ball``: one is a ball joint."""
    A, B, C, D = (0.0, 0.0, 0.0), (0.05, 0.3, 0.0), (0.6, 0.45, 0.0), (0.4, 0.0, 0.0)
    z = (0.0, 0.0, 1.0)
    bodies = {"crank": thin_rod(A, B, 1.0), "coupler": thin_rod(B, C, 1.5), "rocker": thin_rod(D, C, 0.8)}
    joints = {
        "A": Joint("world", "crank", A, z),
        "B": Joint("crank", "coupler", B, z),
        "C": Joint("coupler", "rocker", C, z),
        "D": Joint("rocker", "world", D, z),
    }
    if ball is not None:
        joints[ball] = Joint(joints[ball].one, joints[ball].other, joints[ball].point)
    return Skeleton(bodies, joints)


def parallelogram_skeleton():
    """Three parallel cranks under one bar, hinged everywhere."""
    bodies, joints, z = {}, {}, (0.0, 0.0, 1.0)
    for i in range(3):
        low, high = (0.3 * i, 0.0, 0.0), (0.3 * i + 0.1, 0.2, 0.0)
        bodies[f"crank_{i}"] = thin_rod(low, high, 0.5 + 0.2 * i)
        joints[f"low_{i}"] = Joint("world", f"crank_{i}", low, z)
        joints[f"high_{i}"] = Joint(f"crank_{i}", "bar", high, z)
    bodies["bar"] = thin_rod((0.1, 0.2, 0.0), (0.7, 0.2, 0.0), 2.0)
    return Skeleton(bodies, joints)


def agile_eye_skeleton():
    """Spherical 3RRR of hinges through one point, the first leg's tip a ball joint."""
    axes, bodies, joints = np.eye(3), {}, {}
    body = (0.3, (0.0, 0.05, 0.02), 0.002 * np.eye(3))
    bodies["platform"] = (1.0, (0.03, 0.02, -0.1), 0.01 * np.eye(3))
    for i in range(3):
        bodies |= {f"proximal_{i}": body, f"distal_{i}": body}
        origin = (0.0, 0.0, 0.0)
        joints[f"motor_{i}"] = Joint("world", f"proximal_{i}", origin, tuple(axes[i]))
        joints[f"middle_{i}"] = Joint(f"proximal_{i}", f"distal_{i}", origin, tuple(axes[(i + 1) % 3]))
        joints[f"tip_{i}"] = Joint(f"distal_{i}", "platform", origin, tuple(axes[(i + 2) % 3]))
    return Skeleton(bodies, joints)
