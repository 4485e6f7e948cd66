"""How near a device comes to its wearer: the question that every door asks, and the answer for closed chains.

Links are their own shapes, as capsules: cylinders and capsules with their radius, spheres as they are, a box as the
capsule along its longest edge that holds it, an ellipsoid in the same way. Meshes are left out. Links that are fixed to
the arm or to the torso do not count: cuff and harness touch the wearer. A limb among the roles whose actuator's family
is known is the capsule of that family between its joints, as a wrist's limb is, whatever it looks like. Pieces of
routes between two bodies count as cables of 3 mm radius; those that run along one body do not, nor do the springs of a
device without drives, which may lie on the body.

Limbs and cables are looked at beside one another, too, joined where their ends are
(:mod:`exo_pin.wrist.clearance.clearance`), and so are links of different limbs: of the parts that are left of a device
without torso, arm and links that join more than two others. Links of one limb beside one another are not.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..chain.structure.description import Shape
from ..core.compiled import kernel
from ..core.validation import FloatArray
from ..numerics.vectors import vector
from ..wrist.clearance.clearance import LIMB_RADII, BodyShape, beyond, displaced_end, fitting_radius, segment_distance
from ..wrist.clearance.gaps import NOBODY, Gaps, beyond_own_elbow, named, own_body
from .device_model import DeviceModel, device_model, models_at
from .parts.routes import PlacedRoute
from .postures import placements, reached_postures

if TYPE_CHECKING:
    from ..chain.structure.description import LimbRole
    from .chain_device import ChainDevice
    from .parts.drives import Drive

#: Axes and origin of the torso's frame, as those of the joints.
_TORSO = np.concatenate([np.eye(3), np.zeros((1, 3))])[None]
_CABLE = LIMB_RADII["cable"]
#: Units of work of a pose: some hundred pairs of segments.
_COST = 50


class LinkGaps(Gaps):
    """Gaps of a closed chain; computed when they are asked for.

    Parameters
    ----------
    device : ChainDevice
        The device.
    matrices : ndarray
        Orientations of the arm, shape (N, 3, 3).
    offset : tuple of ndarray, optional
        Where the device's centre lies from the shoulder's, held by the base and carried by the cuff, shape (N, 3) or
        (1, 3) each, m.
    placed : DeviceEquilibrium or Postures, optional
        Its configurations in these poses, where they are known already.
    body : BodyShape, optional
        What to keep clear of; the body of who wears it if left out.
    """

    plural, another = "parts of the device", "another limb or cable"

    def __init__(
        self,
        device: ChainDevice,
        matrices: FloatArray,
        offset: tuple[FloatArray, FloatArray] | None = None,
        placed: Any = None,
        body: BodyShape | None = None,
    ) -> None:
        self._device, self._matrices, self._offset, self._placed = device, matrices, offset, placed
        self._body = own_body(device.arm, device.side) if body is None else body
        self._capsules, found = link_capsules(device), _pieces(device)
        self._names = (*dict.fromkeys(self._capsules.names), *dict.fromkeys(piece.name for piece in found))
        shown = {own.name: name for own, (name, _) in zip(device.efforts, device.drive_units, strict=False)}
        self.parts = tuple(shown.get(name, name) for name in self._names)
        if device.has_limbs and self.parts and set(self.parts) <= set(shown.values()):
            self.plural, self.another = Gaps.plural, Gaps.another
        self.unknown = (() if self._body is not None else (NOBODY,)) + (() if self.parts else ("shapes of the links",))
        own = set(zip(self._capsules.names, _link_pairs(device).limbs.tolist(), strict=True))
        several = len(own) > len({limb for _, limb in own})
        self.left_out = ("links of one limb beside one another",) if several else ()
        self.left_out += ("limbs and cables beside links",) if own and found else ()
        self.left_out += tuple(f"the mesh of {name}" for name in self._capsules.left_out)

    @cached_property
    def _each(self) -> FloatArray:
        """Of each part in each pose, shape (N, P, 3), m."""
        count = len(self._matrices)
        if self.unknown or self._body is None:
            return np.full((count, len(self.parts), 3), np.nan)
        base, cuff = (np.zeros((1, 3)),) * 2 if self._offset is None else self._offset
        # The tree of a device that gives way has an offset among its coordinates.
        soft = self._placed is not None and getattr(self._placed, "moved", None) is not None
        out = np.full((count, len(self.parts), 3), np.inf)
        for rows, model in models_at(self._device, None if soft else self._offset, count):
            q, reached = self._configurations(model, rows)
            shifts = np.broadcast_to(base - cuff, (count, 3))[rows]
            out[rows] = self._of_model(model, q, self._matrices[rows], shifts)
            out[rows[~reached]] = np.nan
        return out

    def _of_model(self, model: DeviceModel, q: FloatArray, matrices: FloatArray, shifts: FloatArray) -> FloatArray:
        """Gaps of each part in each configuration, shape (N, P, 3), m; the torso is displaced by ``shifts``, (N, 3)."""
        assert self._body is not None
        capsules, pieces = self._capsules, _pieces(self._device, model)
        radii = np.array([*capsules.radii, *(piece.radius for piece in pieces)])
        names = [*capsules.names, *(piece.name for piece in pieces)]
        owner, shapes = np.array([self._names.index(name) for name in names]), len(capsules.names)
        joints, ends = capsules.ends[:, 6].astype(np.intp), capsules.ends
        first, second = np.empty((len(q), len(radii), 3)), np.empty((len(q), len(radii), 3))
        for k in range(len(q)):
            # The torso's frame stands first.
            every = np.concatenate([_TORSO, placements(model.held, q[k])])
            poses = every[joints]
            for at, local in ((first, ends[:, :3]), (second, ends[:, 3:6])):
                at[k, :shapes] = np.einsum("sij,si->sj", poses[:, :3], local) + poses[:, 3] - model.centre
            for i, (_, route, piece, _) in enumerate(pieces, start=shapes):
                points = route.points(every) - model.centre
                first[k, i], second[k, i] = points[piece], points[piece + 1]
        out = np.full((len(q), len(self._names), 3), np.inf)
        linked, (pairs, cuts) = _link_pairs(self._device), _cable_pairs(pieces, shapes)
        pairs, cuts = np.concatenate([linked.pairs, pairs]), np.concatenate([linked.cuts, cuts])
        _fill_gaps(
            first,
            second,
            radii,
            owner,
            np.array(matrices),
            np.array(shifts),
            np.array(self._body.torso),
            np.array(self._body.arm),
            out,
        )
        if len(pairs):
            _fill_beside(first, second, radii, owner, pairs, cuts, out[:, :, 2])
        return out

    def _configurations(self, model: DeviceModel, rows: NDArray[np.intp]) -> tuple[FloatArray, NDArray[np.bool_]]:
        if self._placed is not None:
            return self._placed.q[rows], self._placed.reached[rows]
        found = reached_postures(model, self._matrices[rows])
        return found.q, found.reached

    @property
    def beside(self) -> str:
        """Joints of limbs beyond the elbow of who wears it."""
        chain = self._device.chain.model
        joints = [chain.getJointId(limb.platform_joint) for limb in self._device.chain.roles.limbs]
        points = [chain.jointPlacements[k].translation for k in joints if chain.parents[k] == self._device.arm_index]
        return beyond_own_elbow(np.array(points), self._device.arm) if points else ""

    @cached_property
    def least(self) -> FloatArray:
        """See :class:`Gaps`."""
        if self.unknown:
            return np.full((len(self._matrices), 3), np.nan)
        return np.asarray(self._each.min(axis=1))

    def each(self, rows: NDArray[np.intp]) -> FloatArray:
        """See :class:`Gaps`."""
        return np.asarray(self._each[rows].min(axis=0))

    def _subject(self, rows: NDArray[np.intp]) -> str:
        if self.plural == Gaps.plural:
            return super()._subject(rows)
        touching = np.flatnonzero((self.each(rows) < 0.0).any(axis=1)).tolist()
        return named([self.parts[part] for part in touching], self.plural)


class Capsules(NamedTuple):
    """Capsules of moving links.

    Attributes
    ----------
    ends : ndarray
        Two ends in the axes of their joint, and its index, shape (S, 7), m.
    radii : ndarray
        Shape (S,), m.
    names : tuple of str
        Link of each.
    left_out : tuple of str
        Moving links that have a mesh, and no other shape.
    """

    ends: FloatArray
    radii: FloatArray
    names: tuple[str, ...]
    left_out: tuple[str, ...]


def _capsule(shape: Shape) -> tuple[FloatArray, float] | None:
    """Ends in the shape's own frame, shape (2, 3), and radius, m; None for a mesh."""
    size = np.array(shape.size)
    if shape.kind == "sphere":
        return np.zeros((2, 3)), float(size[0])
    if shape.kind in ("cylinder", "capsule"):
        end = np.array([0.0, 0.0, size[1] / 2.0])
        return np.stack([-end, end]), float(size[0])
    if shape.kind in ("box", "ellipsoid"):
        long = int(size.argmax())
        across, end = np.delete(size, long), np.zeros(3)
        # An ellipse of half axes a and b lies within circles of radius b whose centres are a - b from its own.
        radius = float(np.linalg.norm(across) / 2.0 if shape.kind == "box" else across.max())
        end[long] = size[long] / 2.0 if shape.kind == "box" else size[long] - radius
        return np.stack([-end, end]), radius
    return None


@lru_cache(maxsize=64)
def link_capsules(device: ChainDevice) -> Capsules:
    """Capsules of the moving links; made once for devices that are asked again, which are compared by identity."""
    state, arm = device.chain._state, device.arm_index
    starts = {state.model.getJointId(limb.platform_joint) for limb, _ in _limbs(device)}
    rows: list[FloatArray] = []
    radii, names, bare = list[float](), list[str](), list[str]()
    for shape in device.chain.description.shapes:
        own, frame = _capsule(shape), state.model.frames[state.frame_index(shape.frame)]
        if frame.parentJoint in (0, arm) or starts & set(state.model.supports[frame.parentJoint]):
            continue
        if own is None:
            bare.append(shape.frame)
            continue
        place = frame.placement * shape.place
        rows.append(np.concatenate([*(np.asarray(place.act(end)) for end in own[0]), [float(frame.parentJoint)]]))
        radii.append(own[1])
        names.append(shape.frame)
    left_out = tuple(dict.fromkeys(name for name in bare if name not in names))
    return Capsules(np.array(rows).reshape(-1, 7), np.array(radii, dtype=float), tuple(names), left_out)


class _LinkPairs(NamedTuple):
    """Capsules of different limbs, shape (K, 2), their fittings as of :func:`_cable_pairs`, and the limb of each."""

    pairs: NDArray[np.intp]
    cuts: FloatArray
    limbs: NDArray[np.intp]


@lru_cache(maxsize=64)
def _link_pairs(device: ChainDevice) -> _LinkPairs:
    """Of the capsules of links, whose joints on a body that both limbs end at may share a fitting."""
    ends, radii = link_capsules(device)[:2]
    joined = _joined(device)
    limb_of, bodies = _limb_numbers(joined, device.arm_index), ends[:, 6].astype(np.intp)
    limbs = limb_of[bodies]
    pairs = np.argwhere(np.triu((limbs[:, None] != limbs) & (limbs >= 0) & (limbs[:, None] >= 0)))
    cuts = np.zeros((len(pairs), 4))
    for cut, (i, j) in zip(cuts, pairs, strict=True):
        one, other = joined[bodies[i]], joined[bodies[j]]
        for body in one.keys() & other.keys():
            here, there = joined[body][int(bodies[i])], joined[body][int(bodies[j])]
            fitting = fitting_radius(tuple(here.tolist()), tuple(there.tolist()), radii[i] + radii[j])
            places = ((ends[i, :3], one), (ends[i, 3:6], one), (ends[j, :3], other), (ends[j, 3:6], other))
            away = [np.linalg.norm(end - own[body]) for end, own in places]
            cut[:] = np.maximum(cut, fitting - np.array(away))
    return _LinkPairs(pairs, cuts, limbs)


def _joined(device: ChainDevice) -> list[dict[int, FloatArray]]:
    """Of each body, by index of its joint: the bodies that joints and closures join to it, and where on it, m."""
    state, model = device.chain._state, device.chain.model
    found: list[dict[int, FloatArray]] = [{} for _ in range(model.njoints)]
    for joint in range(1, model.njoints):
        found[model.parents[joint]][joint] = np.array(model.jointPlacements[joint].translation)
        found[joint][model.parents[joint]] = np.zeros(3)
    for closure in device.chain.closures:
        if closure.kind.is_coupling:
            continue
        (a, at_a), (b, at_b) = (
            (int(frame.parentJoint), np.array(frame.placement.act(np.array(place.translation))))
            for frame, place in (
                (model.frames[state.frame_index(name)], place)
                for name, place in ((closure.frame_a, closure.placement_a), (closure.frame_b, closure.placement_b))
            )
        )
        found[a][b], found[b][a] = at_a, at_b
    return found


def _limb_numbers(joined: list[dict[int, FloatArray]], arm: int) -> NDArray[np.intp]:
    """Number of the limb that each body belongs to, shape (njoints,); -1 of torso, arm and bodies that join limbs."""
    number = np.array([-1 if body in (0, arm) or len(own) > 2 else body for body, own in enumerate(joined)])
    for _ in joined:
        for body, own in enumerate(joined):
            number[[other for other in own if min(number[other], number[body]) >= 0]] = number[body]
    return number


class _Piece(NamedTuple):
    """A straight piece ``k`` of a route from one body to another, with its radius, m."""

    name: str
    route: PlacedRoute
    k: int
    radius: float


def _pieces(device: ChainDevice, model: DeviceModel | None = None) -> list[_Piece]:
    """Limbs, and pieces of the routes of drives and springs."""
    if not device.drives:
        return []
    model = device_model(device) if model is None else model
    placed: list[tuple[Any, Any]] = [*model.drives, *model.springs]
    routes = [(part.name, place) for part, place in placed if isinstance(place, PlacedRoute)]
    found = [_Piece(name, own, int(k), _CABLE) for name, own in routes for k in np.flatnonzero(np.diff(own.joints))]
    return [*(_limb_piece(device, model, *limb) for limb in _limbs(device)), *found]


def _limbs(device: ChainDevice) -> list[tuple[LimbRole, Drive]]:
    """Limbs among the roles whose actuator's family is known."""
    slides = {drive.joint: drive for drive in device.drives if drive.actuator is not None}
    return [(limb, slides[limb.slide]) for limb in device.chain.roles.limbs if limb.slide in slides]


def _limb_piece(device: ChainDevice, model: DeviceModel, limb: LimbRole, drive: Drive) -> _Piece:
    """A limb from A_i to B_i."""
    state, chain = device.chain._state, device.chain.model
    (closure,) = (own for own in device.chain.closures if own.name == limb.closure)
    place, joint = chain.frames[state.frame_index(closure.frame_b)], chain.getJointId(limb.platform_joint)
    ends = place.placement.act(np.array(closure.placement_b.translation)), chain.jointPlacements[joint].translation
    route = PlacedRoute.between(state, (int(place.parentJoint), int(chain.parents[joint])), ends)
    assert drive.actuator is not None
    return _Piece(drive.name, route.shifted(model.arm, model._cuff), 0, LIMB_RADII[drive.actuator.family])


def _fill_beside(
    first: FloatArray,
    second: FloatArray,
    radii: FloatArray,
    owner: NDArray[np.intp],
    pairs: NDArray[np.intp],
    cuts: FloatArray,
    out: FloatArray,
) -> None:
    """Fill the least gaps of each part to others, shape (N, P); only pairs of pieces that may be nearest are asked."""
    (i, j), both = pairs.T, radii[pairs].sum(axis=1)
    kinds = np.unique(np.sort(owner[pairs], axis=1), axis=0, return_inverse=True)[1].ravel()
    for k in range(len(first)):
        # Fittings end at the middle at most, so that the distance of the middles bounds that of the pieces.
        middle, half = 0.5 * (first[k] + second[k]), 0.5 * np.linalg.norm(second[k] - first[k], axis=1)
        apart = np.linalg.norm(middle[i] - middle[j], axis=1) - both
        most = np.full(kinds.max() + 1, np.inf)
        np.minimum.at(most, kinds, apart)
        near = np.flatnonzero(apart - half[i] - half[j] <= most[kinds])
        gap, one, other = np.empty(len(near)), i[near], j[near]
        _pair_distances(first[k, one], second[k, one], first[k, other], second[k, other], cuts[near], gap)
        for own in (one, other):
            np.minimum.at(out[k], owner[own], gap - both[near])


def _cable_pairs(pieces: list[_Piece], shapes: int) -> tuple[NDArray[np.intp], FloatArray]:
    """Pieces of different limbs and cables, shape (K, 2), and the fittings at the ends of the two, shape (K, 4), m."""
    pairs, cuts = [], []
    for i, (name, route, piece, thick) in enumerate(pieces):
        for j, (other, its, at, wide) in enumerate(pieces[:i]):
            if name == other:
                continue
            cut = np.zeros(4)
            for a in (0, 1):
                for b in (0, 1):
                    if route.joints[piece + a] == its.joints[at + b]:
                        own, their = route.local[piece + a], its.local[at + b]
                        radius = fitting_radius(tuple(own.tolist()), tuple(their.tolist()), thick + wide)
                        cut[a], cut[2 + b] = max(cut[a], radius), max(cut[2 + b], radius)
            pairs.append((shapes + i, shapes + j))
            cuts.append(cut)
    return np.array(pairs, dtype=np.intp).reshape(-1, 2), np.array(cuts, dtype=float).reshape(-1, 4)


@kernel(stack=True, cost=_COST)
def _fill_gaps(
    first: Any, second: Any, radii: Any, owner: Any, R: Any, shift: Any, torso: Any, arm: Any, out: Any
) -> None:
    """Fill the least gaps of each part to arm and torso."""
    for k in range(first.shape[0]):
        moved = vector(shift, k)
        for part in range(2):
            rows = arm if part == 0 else torso
            for j in range(rows.shape[0]):
                a, b = vector(rows[:, 0:3], j), vector(rows[:, 3:6], j)
                if part == 0:
                    a = (
                        R[k, 0, 0] * a[0] + R[k, 0, 1] * a[1] + R[k, 0, 2] * a[2],
                        R[k, 1, 0] * a[0] + R[k, 1, 1] * a[1] + R[k, 1, 2] * a[2],
                        R[k, 2, 0] * a[0] + R[k, 2, 1] * a[1] + R[k, 2, 2] * a[2],
                    )
                    b = (
                        R[k, 0, 0] * b[0] + R[k, 0, 1] * b[1] + R[k, 0, 2] * b[2],
                        R[k, 1, 0] * b[0] + R[k, 1, 1] * b[1] + R[k, 1, 2] * b[2],
                        R[k, 2, 0] * b[0] + R[k, 2, 1] * b[1] + R[k, 2, 2] * b[2],
                    )
                else:
                    a, b = displaced_end(a, moved), displaced_end(b, moved)
                for i in range(first.shape[1]):
                    gap = segment_distance(vector(first[k], i), vector(second[k], i), a, b) - radii[i] - rows[j, 6]
                    out[k, owner[i], part] = min(out[k, owner[i], part], gap)


@kernel(stack=True)
def _pair_distances(p: Any, q: Any, r: Any, t: Any, cuts: Any, out: Any) -> None:
    """Fill the distances between segments pq and rt beyond their fittings, shape (M,), m."""
    for k in range(p.shape[0]):
        one = beyond(vector(p, k), vector(q, k), cuts[k, 0], cuts[k, 1])
        other = beyond(vector(r, k), vector(t, k), cuts[k, 2], cuts[k, 3])
        out[k] = segment_distance(one[0], one[1], other[0], other[1])
