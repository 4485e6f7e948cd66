"""How far the laws of a device's springs cover the elevation of the arm."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..chain import ClosedChain
from ..core.conventions import shoulder_rotation
from ..core.errors import LoopNotClosed
from ..core.errors.checked import checked
from ..core.tables import enumerated
from ..core.validation import FloatArray
from ..device import ChainDevice
from ..device.device_model import device_model
from ..device.parts.laws import covered_force
from ..device.postures import placements, postures
from ..load_case.pose_stacks import pose_matrices
from .report import Finding, Report
from .robots import check_chain

#: Elevations, degrees, and halvings of their step at an end of what is covered: to 0.1°.
_ELEVATIONS, _HALVINGS = np.arange(0.0, 180.1, 3.0), 5
#: Axes and origin of the world, as those of the joints.
_WORLD = np.concatenate([np.eye(3), np.zeros((1, 3))])[None]


@checked
def check_device(device: ChainDevice, chain: ClosedChain | None = None) -> Report:
    """The checks of its chain, and the elevation of the arm that the laws of its springs cover.

    Parameters
    ----------
    device : ChainDevice
        The device.
    chain : ClosedChain, optional
        Its chain with the arm of who wears it; as the device has it if left out.

    Returns
    -------
    Report

    Examples
    --------
    >>> from exo_pin.consistency import check_device
    >>> from exo_pin.device import ChainDevice, Route, Spring, TableLaw
    >>> strut = Route.over(("universe", [0.0, 0.0, -0.4]), ("arm", [0.0, 0.0, -0.2]))
    >>> law = TableLaw((0.3, 0.5), (-40.0, -10.0))  # m, N
    >>> device = ChainDevice.from_chain(ep.load("prototype").chain)
    >>> print(check_device(device.replace(springs=[Spring("strut", law, route=strut)])).findings[-1].detail)
    spring 'strut': law covers 47° to 108° of flexion, 47° to 108° of abduction
    """
    report = check_chain(device.chain if chain is None else chain)
    if not device.springs or any(finding.outcome == "fail" for finding in report.findings):
        return report
    return Report(report.mechanism, (*report.findings, _springs(device)))


def _springs(device: ChainDevice) -> Finding:
    """The range of elevation that each law covers."""
    ranged = [i for i, spring in enumerate(device.springs) if np.isfinite(spring.law.range).any()]
    if not ranged:
        return Finding("springs", "pass", "no law has an end")
    try:
        spans = {name: _covered(device, name) for name in ("flexion", "abduction")}
    except LoopNotClosed:
        return Finding("springs", "note", "the loops do not close with the arm hanging")
    texts, whole = [], True
    for i in ranged:
        parts = []
        for name, (words, complete) in spans.items():
            parts.append(f"{words[i]} of {name}")
            whole &= complete[i]
        texts.append(f"spring {device.springs[i].name!r}: law covers {', '.join(parts)}")
    return Finding("springs", "pass" if whole else "note", "; ".join(texts))


def _covered(device: ChainDevice, plane: str) -> tuple[list[str], list[bool]]:
    """For each spring the elevations in a plane that its law covers, in words, and whether that is all reached."""

    def at(angles: FloatArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        forward, aside = (angles, 0.0) if plane == "flexion" else (0.0, angles)
        return _springs_covered(device, shoulder_rotation(forward, aside, 0.0, side=device.side, degrees=True))

    covers, reached = at(_ELEVATIONS)
    words, complete = [], []
    for i in range(len(device.springs)):

        def inside(angle: float, i: int = i) -> bool:
            return bool(at(np.array([angle]))[0][0, i])

        words.append(_spans(covers[:, i], inside))
        complete.append(bool(covers[reached, i].all()))
    return words, complete


def _springs_covered(device: ChainDevice, poses: Rotation) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which of N poses the law of each of S springs covers, shape (N, S), and which the device reaches, shape (N,).

    Raises
    ------
    LoopNotClosed
        If the loops do not close with the arm hanging.
    """
    model, (_, matrices) = device_model(device), pose_matrices(poses)
    found = postures(model, matrices)
    covers = np.zeros((len(matrices), len(model.springs)), dtype=bool)
    for k in np.flatnonzero(found.reached):
        places = np.concatenate([_WORLD, placements(model.held, found.q[k])])
        q = model.free_configuration(found.q[k])
        for i, (spring, place) in enumerate(model.springs):
            covers[k, i] = np.isfinite(covered_force(spring.law, model.coordinate(place, q, places)))
    return covers, found.reached


def _spans(covers: NDArray[np.bool_], inside: Callable[[float], bool]) -> str:
    """Ranges of elevation in words, their ends found by halving the step."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], covers, [False]])))
    spans = []
    for first, beyond in edges.reshape(-1, 2).tolist():
        low = _end(first, first - 1, inside) if first else _ELEVATIONS[0]
        high = _end(beyond - 1, beyond, inside) if beyond < len(_ELEVATIONS) else _ELEVATIONS[-1]
        spans.append(f"{low:.0f}° to {high:.0f}°")
    return enumerated(spans) if spans else "none"


def _end(within: int, without: int, inside: Callable[[float], bool]) -> float:
    """Last elevation covered between one that is and one that is not, degrees."""
    ins, out = float(_ELEVATIONS[within]), float(_ELEVATIONS[without])
    for _ in range(_HALVINGS):
        middle = 0.5 * (ins + out)
        ins, out = (middle, out) if inside(middle) else (ins, middle)
    return ins
