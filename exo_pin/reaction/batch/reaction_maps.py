"""Reactions over millions of poses, compiled, in blocks, on several threads."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...core.conventions import pose_columns
from ...core.errors import InvalidInput
from ...core.errors.base import echo
from ...core.errors.checked import checked
from ...core.progress import track
from ...core.results import Result
from ...core.validation import FloatArray, ReadOnly, as_choice, as_count
from ...design import Mechanism
from ...device.wrist_device import as_device
from ...load_case.case import Case
from ...numerics.vectors import SINGULAR
from ..answer import QUERY_STATUS
from ..assumptions import Assumptions
from ..columns import force_columns, peak_of
from ..constraints.actuator_limits import limits_motion
from ..constraints.given_limits import SideForceBounds, are_actuators, two_ends
from ..holding.verdict import UNSOLVED
from ..result import Reaction
from ..solve_case import solve
from ..splits.split import Minimal, Spherical, Split, Standalone
from . import map_kernels
from .limit_kernels import BEYOND, UNLIMITED, check_limits
from .map_kernels import LimbPoints, Outputs, PoseBlocks, TermBlocks, Terms, map_three
from .map_limits import compiled_limits, have_one_form

#: The kernels' codes of the splits, whose children they do not know.
_LAWS = {Spherical: map_kernels.SPHERICAL, Standalone: map_kernels.STANDALONE, Minimal: map_kernels.MINIMAL}
_CODES = {name: code for code, name in enumerate(QUERY_STATUS)}
_NOT_SOLVED, _INFEASIBLE = QUERY_STATUS.index("not_solved"), QUERY_STATUS.index("infeasible")
#: Poses in a block: enough to make the cost of starting one small, few enough for the caches.
CHUNK = 32768
#: Quantities that a map can return, in the order of the kernels' outputs.
_KEEP = ("shoulder_force", "actuator_forces", "constraint_forces", "status", "margin", "magnitude")


@dataclass(frozen=True, eq=False)
class ReactionMap(Result, ReadOnly):
    """Forces over a stack of poses of shape (...), massless limbs; None for what ``keep`` leaves out.

    Base frame; rows without an answer are NaN, and ``status`` gives the reason.

    Attributes
    ----------
    shoulder_force : ndarray or None
        F_s, shape (..., 3), N: the force of the shoulder **on the arm**.
    actuator_forces : ndarray or None
        f_i, shape (..., n), N, tension positive.
    constraint_forces : ndarray or None
        g_i, shape (..., n), N: the limb pulls the arm with -f_i s_i - g_i X_i; zero for an SPS limb.
    status_codes : ndarray of int8 or None
        Shape (...), index into :data:`exo_pin.reaction.answer.QUERY_STATUS`; :attr:`status` gives the names.
    unknown : ndarray of bool or None
        Shape (...): whether it depends on a limit that is not known, or not asked for, if the pose can be held, or
        no equilibrium was found.
    margin : ndarray or None
        Shape (...): dimensionless distance from the singular surface (see ``exo_pin.wrist.limbs.Limbs``).
    magnitude : ndarray or None
        |F_s|, shape (...), N.
    split : str
        How the forces that equilibrium does not determine were chosen.
    trivial : bool
        Whether the least shoulder force is zero by construction, as in :class:`exo_pin.Reaction`.
    drive_units : tuple of (str, str)
        Name and unit of each f_i, as :attr:`exo_pin.Reaction.drive_units`.
    poses : Rotation or None
        Of shape (...), as they were asked for.
    side : str
        Side of the body that clinical angles are of.

    Examples
    --------
    >>> exo = ep.load("four-cables")
    >>> found = exo.reaction_map(exo.pose([[30], [60]], [20, 40]))
    >>> found.magnitude.shape, round(float(found.magnitude[0, 1] - exo.reaction(exo.pose(30, 40)).magnitude), 9)
    ((2, 2), 0.0)
    """

    shoulder_force: FloatArray | None
    actuator_forces: FloatArray | None
    constraint_forces: FloatArray | None
    status_codes: NDArray[np.int8] | None
    unknown: NDArray[np.bool_] | None
    margin: FloatArray | None
    magnitude: FloatArray | None
    split: str
    trivial: bool = False
    drive_units: tuple[tuple[str, str], ...] = ()
    poses: Rotation | None = None
    side: str = "left"

    @property
    def status(self) -> NDArray[np.str_]:
        """Shape (...): as :attr:`exo_pin.Reaction.status`, made anew at every call.

        Raises
        ------
        InvalidInput
            If ``keep`` left the status out.
        """
        return np.array(QUERY_STATUS)[self._codes()]

    @property
    def has_answer(self) -> NDArray[np.bool_]:
        """Shape (...): whether the pose has an answer; raises as :attr:`status`."""
        codes = self._codes()
        return (codes < SINGULAR) | (codes >= _INFEASIBLE)

    @property
    def held(self) -> NDArray[np.bool_]:
        """Shape (...): whether there is an answer, and no limit that is known is broken; raises as :attr:`status`."""
        return self._codes() < SINGULAR

    @property
    def can_hold(self) -> NDArray[np.bool_]:
        """Shape (...): true only where every limit is known, none is estimated, and all are met."""
        return self.held & ~np.asarray(self.unknown)

    @property
    def peak(self) -> float:
        """Largest |F_s| of all poses that can be held as far as limits are known, N; NaN if there is none.

        Raises
        ------
        InvalidInput
            If the map has no status, or neither |F_s| nor F_s.
        """
        return peak_of(self._magnitude[self.held])

    def columns(self) -> dict[str, Any]:
        """Pose, verdict, status and the selected quantities of every pose, with units in the names.

        Returns
        -------
        dict of str to ndarray
            Each of the stack's shape; the verdict is "held", "not held" or "not known".

        Examples
        --------
        >>> exo = ep.load("four-cables")
        >>> found = exo.reaction_map(exo.pose([0, 30]), keep=["magnitude"])
        >>> list(found.columns())
        ['flexion_deg', 'abduction_deg', 'internal_rotation_deg', 'F_s_N']
        """
        columns = {} if self.poses is None else dict(pose_columns(self.poses, self.side))
        if self.status_codes is not None:
            open_ = np.asarray(self.unknown) | np.isin(self.status, UNSOLVED)
            words = np.where(self.can_hold, "held", np.where(open_, "not known", "not held"))
            columns |= {"verdict": words.astype(object), "status": self.status.astype(object)}
        return columns | force_columns(self)

    @property
    def _magnitude(self) -> FloatArray:
        """|F_s|, from F_s if need be."""
        if self.magnitude is not None:
            return self.magnitude
        if self.shoulder_force is None:
            raise InvalidInput('the map has neither |F_s| nor F_s: add "magnitude" to keep')
        return np.asarray(np.linalg.norm(self.shoulder_force, axis=-1))

    def _codes(self) -> NDArray[np.int8]:
        if self.status_codes is None:
            raise InvalidInput('the map has no status: add "status" to keep')
        return self.status_codes


@checked
def reaction_map(
    device: Any,
    case: Case,
    assumptions: Assumptions,
    *,
    threads: int = 1,
    chunk: int = CHUNK,
    keep: Iterable[str] | None = None,
    progress: bool = False,
) -> ReactionMap:
    """Forces over many poses; see :meth:`exo_pin.ShoulderExo.reaction_map`.

    Parameters
    ----------
    device : ShoulderExo
        With massless limbs.
    case : Case
        Poses, motion, load and centre offset.
    assumptions : Assumptions
        Split, limits, bounds and cone.
    threads, chunk, keep, progress
        As there.

    Returns
    -------
    ReactionMap

    Examples
    --------
    >>> exo = ep.load("prototype")
    >>> case = ep.Case(exo.pose(np.linspace(10.0, 30.0, 5)), load=ep.Load([0.0, 0.0, -5.0]))
    >>> found = ep.reaction.reaction_map(exo, case, ep.Assumptions("standalone", "none"))
    >>> bool((found.magnitude == 0.0).all())  # by assumption the wrist carries the arm without the shoulder
    True
    """
    if case.wearer is not None:
        device, case = device.worn_by(case.wearer), replace(case, wearer=None)
    mechanism = as_device(device).accelerate("map")
    selected = _selected(keep)
    if mechanism is None or case.posture is not None or not _has_closed_form(mechanism, case, assumptions):
        return _map_of(solve(device, case, assumptions, progress=progress), selected)
    law = assumptions.law
    code = _LAWS[type(law)]
    n, upu = mechanism.limb_count, np.flatnonzero(mechanism.is_upu)
    law.check(mechanism)
    if not _are_compiled(assumptions, mechanism):
        found = _in_parts(device, case, assumptions, selected, n, as_count("chunk", chunk, 1), progress)
        bounds = SideForceBounds(assumptions.constraint_bounds, case.poses.shape, n, one_signed=True)
        return replace(found, trivial=_is_trivial(law, mechanism, bounds))
    poses = PoseBlocks(case.poses)
    terms = TermBlocks(mechanism, case.motion, case.load, poses.shape)
    limits = compiled_limits(assumptions.limits, mechanism)
    limited, one_signed = limits is not UNLIMITED, bool((limits.lower >= 0.0).all() or (limits.upper <= 0.0).all())
    bounds = SideForceBounds(assumptions.constraint_bounds, poses.shape, n, one_signed)
    geometry = mechanism.geometry
    # Writable arrays, so that the kernels are compiled for one kind of array only.
    points = LimbPoints(
        *(np.array(array, order="C") for array in (geometry.base_points, geometry.platform_points, upu))
    )
    threads, chunk = as_count("threads", threads, 1), as_count("chunk", chunk, 1)
    outputs = _outputs(poses.count, n, selected)
    unknown = np.zeros(poses.count if "status" in selected else 0, dtype=bool)

    def compute(start: int) -> None:
        stop = min(start + chunk, poses.count)
        q, own, out = poses.block(start, stop), terms.block(start, stop), Outputs(*(a[start:stop] for a in outputs))
        if limited:
            # Limits need all of them, also those that nobody keeps.
            others = _outputs(stop - start, n, set(_KEEP) - selected)
            out = Outputs(*(kept if len(kept) else other for kept, other in zip(out, others, strict=True)))
        if n == 3 and code != map_kernels.MINIMAL:
            map_three(q, points, own, code == map_kernels.STANDALONE, out)
        else:
            map_kernels.map_any(q, points, own, code, bounds.by_actuator, *bounds.block(start, stop), limits, out)
        if not limited:
            return
        open_ = np.empty(len(q), dtype=bool)
        check_limits(q, points.base, points.platform, limits, out.f, out.status, open_)
        beyond = np.flatnonzero(out.status > _INFEASIBLE)
        if n == 3 and law.chooses_sides:
            # Equilibrium determines these tensions: they stay, without side forces.
            plain, part = _outputs(beyond.size, n, set(_KEEP)), Terms(*own[:-5], *_rows(own[-5:], beyond))
            map_three(np.ascontiguousarray(q[beyond]), points, part, False, plain)
            for name in ("shoulder", "f", "g", "magnitude"):
                getattr(out, name)[beyond] = getattr(plain, name)
        left = beyond if law.chooses_sides else beyond[out.status[beyond] == BEYOND]
        if n > 3 and left.size:
            # What these kernels do not choose.
            asked = _cut(case, assumptions, start + left, n)
            found = _map_of(solve(device, *asked, progress=progress and len(starts) == 1), set(_KEEP))
            for name, array in zip(_KEEP, out, strict=True):
                array[left] = getattr(found, "status_codes" if name == "status" else name)
            open_[left] = found.unknown
        if len(unknown):
            unknown[start:stop] = open_

    starts = range(0, poses.count, chunk)
    for _ in track(_run(compute, starts, threads), f"reaction map, {law.name}", progress, total=len(starts)):
        pass
    filled: dict[str, Any] = {
        name: array.reshape((*poses.shape, *array.shape[1:])) if name in selected else None
        for name, array in zip(_KEEP, outputs, strict=True)
    }
    unknown |= outputs.status == _NOT_SOLVED
    if not limited:
        unknown |= outputs.status < SINGULAR
    filled["unknown"] = unknown.reshape(poses.shape) if "status" in selected else None
    more = {"split": law.name, "trivial": _is_trivial(law, mechanism, bounds), "drive_units": mechanism.drive_units}
    more |= {"poses": case.poses, "side": mechanism.side}
    return ReactionMap(status_codes=filled.pop("status"), **filled, **more)


def _has_closed_form(mechanism: Mechanism, case: Case, assumptions: Assumptions) -> bool:
    """Whether the kernels answer a question: massless limbs about the shoulder's own centre, no socket, no weights."""
    if any(limb.mass > 0.0 for limb in mechanism.limbs) or (case.motion is not None and limits_motion(mechanism)):
        return False
    plain = case.centre_offset is None and assumptions.cone is None and assumptions.weights is None
    return plain and type(assumptions.law) in _LAWS


def _are_compiled(assumptions: Assumptions, mechanism: Mechanism) -> bool:
    """Whether the kernels know the limits and bounds of a question."""
    # With more than three limbs these are chosen together with the tensions, if at all.
    by_word = isinstance(assumptions.constraint_bounds, str) and mechanism.limb_count > 3
    return not by_word and have_one_form(assumptions.limits, mechanism)


def _is_trivial(law: Split, mechanism: Mechanism, bounds: SideForceBounds) -> bool:
    """Whether tensions that balance themselves, and side forces without a bound, produce every shoulder force."""
    free = mechanism.limb_count - 3 + (int(mechanism.is_upu.sum()) if bounds.is_free else 0)
    return type(law) is Minimal and free >= 3


def _cut(case: Case, assumptions: Assumptions, rows: NDArray[np.intp], limb_count: int) -> tuple[Case, Assumptions]:
    """The question of some rows of the flat stack, with what is their own of all that may differ from pose to pose."""
    own: dict[str, Any] = {}
    for name in ("limits", "constraint_bounds"):
        given = getattr(assumptions, name)
        if isinstance(given, tuple | list | np.ndarray) and not are_actuators(given):
            own[name] = tuple(case._own(end, rows, limb_count) for end in two_ends(given, name))
    return case._cut(rows), replace(assumptions, **own)


def _map_of(answer: Reaction, selected: set[str]) -> ReactionMap:
    """The map of an answer that keeps the selected quantities."""
    kept: dict[str, Any] = {name: getattr(answer, name) if name in selected else None for name in _KEEP}
    codes = unknown = None
    if kept.pop("status") is not None:
        codes = np.vectorize(_CODES.__getitem__, otypes=[np.int8])(answer.status)
        unknown = answer.unknown
    more = {"split": answer.split, "trivial": answer.trivial, "drive_units": answer.drive_units}
    more |= {"poses": answer.case.poses, "side": answer.source.poses.mechanism.side}
    return ReactionMap(**kept, status_codes=codes, unknown=unknown, **more)


def _in_parts(
    device: Any, case: Case, assumptions: Assumptions, selected: set[str], limb_count: int, chunk: int, progress: bool
) -> ReactionMap:
    """The map of a question that the kernels do not know, so many poses at a time: an answer is larger than its map."""
    shape, count = case.poses.shape, math.prod(case.poses.shape)
    if count <= chunk:
        return _map_of(solve(device, case, assumptions, progress=progress), selected)
    starts = range(0, count, chunk)
    parts = [
        _map_of(
            solve(device, *_cut(case, assumptions, np.arange(start, min(start + chunk, count)), limb_count)), selected
        )
        for start in track(starts, f"reaction map, {assumptions.law.name}", progress, total=len(starts))
    ]
    whole: dict[str, Any] = {"poses": case.poses}
    for name in (*_KEEP, "unknown"):
        field = "status_codes" if name == "status" else name
        if getattr(parts[0], field) is not None:
            joined = np.concatenate([getattr(part, field) for part in parts])
            whole[field] = joined.reshape(*shape, *joined.shape[1:])
    return replace(parts[0], **whole)


def _run(compute: Callable[[int], None], starts: range, threads: int) -> Iterator[None]:
    """Call ``compute`` for every start, yielding after each; after an error or an interrupt no further block starts."""
    # A single block is not worth a thread of its own.
    if min(threads, len(starts)) <= 1:
        for start in starts:
            compute(start)
            yield
        return
    with ThreadPoolExecutor(threads) as pool:
        futures = [pool.submit(compute, start) for start in starts]
        try:
            for future in futures:
                yield future.result()
        finally:
            for future in futures:
                future.cancel()


def _selected(keep: Iterable[str] | None) -> set[str]:
    if keep is None:
        return set(_KEEP)
    if not isinstance(keep, Iterable):
        raise InvalidInput(f"expected keep to be names of quantities, got {echo(keep)}")
    return {as_choice("quantity to keep", name, _KEEP) for name in ([keep] if isinstance(keep, str) else keep)}


def _rows(vectors: Iterable[FloatArray], rows: NDArray[np.intp]) -> Iterator[FloatArray]:
    """Rows of what has one a pose."""
    return (each if len(each) == 1 else np.ascontiguousarray(each[rows]) for each in vectors)


def _outputs(count: int, limb_count: int, selected: set[str]) -> Outputs:
    """Arrays for the quantities of ``keep``, and arrays without rows for the others."""
    widths = ((3,), (limb_count,), (limb_count,), (), (), ())
    return Outputs(
        *(
            np.empty((count if name in selected else 0, *width), dtype=np.int8 if name == "status" else np.float64)
            for name, width in zip(_KEEP, widths, strict=True)
        )
    )
