"""The limbs of a device with a guide, or without one, where the chain has them.

Guides of a device that bend and twist, as springs between the two halves of a limb.

The halves end in points P and C, with unit vectors t_P and t_C of the guide's ends and w_P and w_C across them. With s
along P C, the ends are turned against the line by θ_P and θ_C (exp [θ] s = t), and against each other about it by ψ,
the angle from w_P to w_C, both turned back. The strain energy is that of :mod:`exo_pin.wrist.forces.bent_guides`, where
the equations of the universal joints are solved for one limb at a time; here the joints are those of the chain:

    U = ½ (θ_P, θ_C) F⁻¹ (θ_P, θ_C) + ½ τ² / (l/GJ + 2/k_t),      τ = ψ + ½ s · (θ_P × θ_C)

Its slopes over turns of the two ends, by complex steps, are the couples on them, and the force across the limb balances
these. Along it the guide bears nothing: the slide's drive acts there.

Springs of a device that gives way: displacements and generalised forces on its tree.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pinocchio as pin

from ...chain.structure.motion_axes import q_slice, v_slice
from ...core.errors import InvalidInput
from ...core.validation import FloatArray
from ...design import Interface, LimbGuide
from ...numerics.analytic_vectors import angle_about, cross_matrix, dot, turn_coefficients
from ..chain_roles import soft_bodies
from ..device_model import DeviceModel
from ..parts.soft_parts import GuidedSlide

if TYPE_CHECKING:
    from ..chain_device import ChainDevice

#: What the names of the joints of a guide, and of a limb that may twist, end in.
OF_GUIDE, OF_TWIST = "_guide", "_twist"
#: Sine of the angle between a slide and the line of its limb's joints that is rounding.
_ALONG = 1e-6


class GuidedLimb(NamedTuple):
    """A limb between two joints.

    Attributes
    ----------
    part : GuidedSlide
        What resists.
    near, far : ndarray
        The joint that carries the slide in the axes of the slide's placement, and the one that it carries in those of
        the slide's body, shape (3,), m.
    along : ndarray
        Unit vector from one to the other, shape (3,), in both.
    length : float
        Between them where the slide is at zero, m.
    """

    part: GuidedSlide
    near: FloatArray
    far: FloatArray
    along: FloatArray
    length: float

    @property
    def joint(self) -> str:
        """Name of the joint that takes the place of the slide, or follows it."""
        return self.part.slide + (OF_GUIDE if self.part.resists else OF_TWIST)


def guided_limbs(device: ChainDevice) -> dict[int, GuidedLimb]:
    """Limbs by the index of their slides.

    Raises
    ------
    InvalidInput
        If what is named is no slide between two joints on the line of the slide, or its drive pushes.
    """
    state, found = device.chain._state, dict[int, GuidedLimb]()
    model, springs = state.model, soft_bodies(device)
    # Half a unit of the file's last digit in the places of both joints, and in the slide's direction.
    digits = device.chain.description.tolerance or device.chain.description.rounding
    for part in device.guided_slides:
        joint, own = state.joint_index(part.slide), f"expected {part.slide!r} to be a slide of a limb"
        if model.joints[joint].nv != 1 or not state.topology.metres[model.joints[joint].idx_v]:
            raise InvalidInput(f"{own}, got {model.joints[joint].shortname()}")
        carried = [k for k, parent in enumerate(model.parents) if parent == joint]
        if model.parents[joint] == 0 or len(carried) != 1:
            raise InvalidInput(f"{own} between two joints, got {len(carried)} joints that it carries")
        data = model.joints[joint].createData()
        model.joints[joint].calc(data, np.ones(model.nq))
        axis = np.array(data.M.translation)
        near = model.jointPlacements[joint].inverse().translation
        far = np.array(model.jointPlacements[carried[0]].translation)
        span = far - near
        length = float(np.linalg.norm(span))
        across = max(_ALONG * length, 4.0 * digits)
        if not np.linalg.norm(np.cross(span, axis)) <= across or span @ axis < 0.0:
            raise InvalidInput(f"{own} that is longer at larger coordinates, along the line of its two joints")
        if joint in found:
            raise InvalidInput(f"expected one guide of {part.slide!r}")
        if joint in springs:
            raise InvalidInput(f"expected a guide or a spring of {springs[joint]!r}, got both")
        if part.resists and any(drive.joint == part.slide and not drive.pulls for drive in device.drives):
            raise InvalidInput(f"expected the drive of {part.slide!r} with pulls=True: that of a limb with a guide")
        if any(spring.joint == part.slide for spring in device.springs):
            raise InvalidInput(f"expected no spring in {part.slide!r}, which has a guide: lay it along a route")
        found[joint] = GuidedLimb(part, near, far, span / length, length)
    return found


def straight(joint: pin.JointModel, q: FloatArray) -> FloatArray:
    """The free flight, shape (7,), that stands for a slide in a configuration of its chain."""
    data = joint.createData()
    joint.calc(data, q)
    return np.array(pin.SE3ToXYZQUAT(data.M))


#: Coefficients of arcsin x / x in x², enough for ends that turn by half a radian.
_ARCSIN = np.cumprod([1.0, *((2 * n - 1) / (2 * n) for n in range(1, 24))]) / (2.0 * np.arange(24) + 1.0)
#: Imaginary step, and the largest sine of an end's turn for which the series is exact.
_STEP, _LARGEST = 1e-30, 0.6


class PlacedGuide(NamedTuple):
    """A guide in the trees of a device.

    Attributes
    ----------
    name : str
        Its joint, a free flight in the place of the limb's slide.
    held, own : slice
        Its coordinates in q of the held tree, and in v of the free one.
    guide : LimbGuide
        Its stiffness.
    near, far : ndarray
        P in the axes of the joint's placement, and C in those of the body that it carries, shape (3,), m.
    along : ndarray
        Unit vector from P to C of the straight guide, in both, shape (3,).
    """

    name: str
    held: slice
    own: slice
    guide: LimbGuide
    near: FloatArray
    far: FloatArray
    along: FloatArray

    def displacement(self, q: FloatArray, base: FloatArray, cuff: FloatArray) -> FloatArray:
        """θ_P and θ_C, shape (6,), rad, in the axes of the joint's placement."""
        span, R = self._span(q)
        s = span / np.linalg.norm(span)
        return np.concatenate([_turn(s, t) for t in (self.along, R @ self.along)])

    def load(self, q: FloatArray, base: FloatArray, cuff: FloatArray) -> FloatArray:
        """Generalised force of the guide on its joint in the free tree, shape (6,); NaN of one that bends too far."""
        span, R = self._span(q)
        length = float(np.linalg.norm(span))
        s = span / length
        ends = np.stack([self.along, R @ self.along])
        w = np.cross(self.along, np.eye(3)[np.abs(self.along).argmin()])
        w /= np.linalg.norm(w)
        sides = np.stack([w, R @ w])
        # Each end turned about each axis.
        turned = np.eye(3) + 1j * _STEP * cross_matrix(np.eye(3))
        t = np.repeat(ends[None].astype(complex), 6, axis=0)
        x = np.repeat(sides[None].astype(complex), 6, axis=0)
        for end in range(2):
            mine = slice(3 * end, 3 * end + 3)
            t[mine, end], x[mine, end] = turned @ ends[end], turned @ sides[end]
        near, far = np.split(-_energy(self.guide, length, s, t, x).imag / _STEP, 2)
        force = np.cross(s, near + far) / length
        about = far + np.cross(R @ self.far, force)
        return np.concatenate([R.T @ force, R.T @ about])

    def along_motion(self, q: FloatArray) -> FloatArray:
        """Motion of its joint that lengthens the limb and strains no guide, shape (6, 1)."""
        span, R = self._span(q)
        return np.concatenate([R.T @ span, np.zeros(3)])[:, None] / np.linalg.norm(span)

    def _span(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """From P to C, shape (3,), m, and the turn of the body against the joint's placement."""
        own = q[self.held]
        R = pin.Quaternion(own[3:]).matrix()
        return own[:3] + R @ self.far - self.near, R


def _energy(guide: LimbGuide, length: float, s: FloatArray, t: FloatArray, x: FloatArray) -> FloatArray:
    """U of ends t and of vectors x across them, shape (k, 2, 3): shape (k,), N m."""
    shear, couple = 2.0 / (guide.joint_stiffness * length**2), 1.0 / guide.joint_twist_stiffness
    own = length / (3.0 * guide.bending_rigidity) + shear + couple
    other = -length / (6.0 * guide.bending_rigidity) + shear
    scale = 1.0 / (own * own - other * other)
    torsion = 1.0 / (length / guide.torsional_rigidity + 2.0 * couple)
    turn = _turn(s, t)
    back = _turned_back(turn, x)
    twist = angle_about(s, back[:, 0], back[:, 1]) + 0.5 * dot(np.cross(turn[:, 0], turn[:, 1]), s)
    each = 0.5 * own * (turn * turn).sum(axis=(1, 2)) - other * dot(turn[:, 0], turn[:, 1])
    return np.asarray(scale * each + 0.5 * torsion * twist**2)


def _turn(s: FloatArray, t: FloatArray) -> FloatArray:
    """θ across s with exp [θ] s = t, of shape (..., 3); NaN where it is large."""
    across = np.cross(s, t)
    square = (across * across).sum(axis=-1, keepdims=True)
    factor = np.polynomial.polynomial.polyval(square, _ARCSIN)
    fits = (square.real < _LARGEST**2) & (dot(t, s).real > 0.0)[..., None]
    return np.asarray(np.where(fits, factor * across, np.nan))


def _turned_back(turn: FloatArray, x: FloatArray) -> FloatArray:
    """exp [-θ] x."""
    sine, near, _ = turn_coefficients((turn * turn).sum(axis=-1, keepdims=True))
    around = np.cross(turn, x)
    return np.asarray(x - sine * around + near * np.cross(turn, around))


#: Names of the joints of cuff, harness and shoulder, and what the one of a link ends in.
CUFF, HARNESS, SHOULDER, OF_LINK = "cuff_spring", "harness_spring", "shoulder_spring", "_spring"


def gives_way(device: ChainDevice) -> bool:
    """Whether any part of a device has a stiffness."""
    guides = any(part.resists for part in device.guided_slides)
    return bool(device.soft_links) or guides or not device.interfaces.are_rigid or device.shoulder.stiffness is not None


class PlacedSpring(NamedTuple):
    """A spring in the trees of a device.

    Attributes
    ----------
    name : str
        Its joint.
    held, own : slice
        Its coordinates in q of the held tree, and in v of the free one.
    stiffness : ndarray
        Shape (6, 6), or (3, 3) of the shoulder.
    at : ndarray
        The point meant, shape (3,), m, in the axes of the body under it.
    """

    name: str
    held: slice
    own: slice
    stiffness: FloatArray
    at: FloatArray

    def displacement(self, q: FloatArray, base: FloatArray, cuff: FloatArray) -> FloatArray:
        """Displacement and rotation vector at the spring's point, shape (6,), or displacement of the shoulder's, (3,).

        Parameters
        ----------
        q : ndarray
            Configuration of the held tree.
        base, cuff : ndarray
            Offsets of the device's centre, shape (3,), m, which load no spring.
        """
        own, unloaded = q[self.held], {SHOULDER: base, CUFF: cuff}.get(self.name, np.zeros(3))
        if len(own) == 3:
            return np.asarray(own - unloaded)
        turn = pin.skew(own[3:6])
        across = 2.0 * turn @ self._arm(base, cuff)
        # What a small turn moves, without the difference of two long arms, whose rounding a stiff spring makes a force.
        moved = own[6] * across + turn @ across
        return np.concatenate([own[:3] - unloaded + moved, pin.log3(pin.Quaternion(own[3:]))])

    def load(self, q: FloatArray, base: FloatArray, cuff: FloatArray) -> FloatArray:
        """Generalised force on its joint in the free tree, shape (6,) or (3,); see :meth:`displacement`."""
        wrench = -self.stiffness @ self.displacement(q, base, cuff)
        return np.asarray(wrench if len(wrench) == 3 else self.jacobian(q, base, cuff).T @ wrench)

    def jacobian(self, q: FloatArray, base: FloatArray, cuff: FloatArray) -> FloatArray:
        """Rate of the displacement over the velocity of its joint, shape (6, 6); see :meth:`displacement`."""
        R = pin.Quaternion(q[self.held][3:]).matrix()
        # The rate of the rotation vector is the inverse of the left Jacobian times the turn's.
        lever = R @ self._arm(base, cuff)
        return np.block([[R, -pin.skew(lever) @ R], [np.zeros((3, 3)), pin.Jlog3(R).T @ R]])

    def along_motion(self, q: FloatArray) -> FloatArray:
        """Motions of its joint that strain no spring: none, shape (6, 0) or (3, 0)."""
        return np.zeros((self.own.stop - self.own.start, 0))

    def _arm(self, base: FloatArray, cuff: FloatArray) -> FloatArray:
        """From the spring's joint, which is in the device's centre, to the point that is meant."""
        return np.asarray(self.at - {HARNESS: base, CUFF: cuff}.get(self.name, np.zeros(3)))


def placed_springs(device: ChainDevice, model: DeviceModel) -> list[PlacedSpring | PlacedGuide]:
    """Springs of shoulder, harness, cuff and links, and guides, in this order; of those that are not rigid."""
    held, free = model.held.model, model.free.model
    parts: dict[str, Interface | None] = {HARNESS: device.interfaces.harness, CUFF: device.interfaces.cuff}
    parts |= {soft.link + OF_LINK: soft.spring for soft in device.soft_links}
    known = {name: (np.array(part.stiffness), np.array(part.at)) for name, part in parts.items() if part is not None}
    if device.shoulder.stiffness is not None:
        known = {SHOULDER: (np.array(device.shoulder.stiffness), np.zeros(3))} | known

    def slices(name: str) -> tuple[slice, slice]:
        return q_slice(held, held.getJointId(name)), v_slice(free, free.getJointId(name))

    guides = [
        PlacedGuide(limb.joint, *slices(limb.joint), limb.part.guide, limb.near, limb.far, limb.along)
        for limb in guided_limbs(device).values()
        if limb.part.guide is not None and limb.part.resists
    ]
    return [*(PlacedSpring(name, *slices(name), *own) for name, own in known.items()), *guides]
