"""Writing a closed chain as URDF with a closures file, as MJCF or as SDF."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from numpy.typing import ArrayLike

from ...core.files import as_file_stem, write_files
from ...core.validation import FloatArray
from ..kinematics.closing import close, reference_configuration
from ..kinematics.loops import closed_configuration
from ..structure.chain_state import ChainState
from .closures_file import closures_text
from .mjcf.mjcf_writing import mjcf_text
from .sdf.sdf_writing import sdf_text
from .urdf.urdf_writing import urdf_text


def to_urdf(state: ChainState, folder: str | PathLike[str]) -> Path:
    """Write a URDF and the closures file beside it, both named after the chain, and return the URDF's path.

    See :func:`exo_pin.chain.formats.urdf.urdf_writing.urdf_text` for where damping, friction, limits, springs and
    armatures go, and for what is raised.

    Parameters
    ----------
    folder : path-like
        The folder; made if it does not exist.

    Returns
    -------
    Path

    Examples
    --------
    >>> chain = ep.load("four-cables").chain_with_masses()
    >>> ep.ClosedChain.from_urdf(chain.to_urdf("copy")).model.nv == chain.model.nv
    True
    """
    text, closures = urdf_text(state)
    stem = _stem(state)
    more = ", its springs and armatures" if closures.joints else ""
    note = f"What {stem}.urdf leaves out: its root, its loops, its roles{more}. Written by exo_pin."
    files = {f"{stem}.urdf": text, f"{stem}.closures.toml": closures_text(closures, note)}
    return write_files(folder, files)[0]


def to_mjcf(state: ChainState, folder: str | PathLike[str], q: ArrayLike | None = None) -> Path:
    """Write a MuJoCo model and return its path.

    Parameters
    ----------
    folder : path-like
        The folder; made if it does not exist.
    q : array_like, optional
        Shape (nq,), the configuration of the keyframe "closed"; found from the rest configuration if left out.

    Returns
    -------
    Path

    Raises
    ------
    InvalidInput
        See :func:`exo_pin.chain.formats.mjcf.mjcf_writing.mjcf_text`.
    LoopNotClosed
        If the loops are not closed at q, or q is left out and the loops do not close.

    Examples
    --------
    >>> chain = ep.load("four-linear-actuators").chain_with_masses()
    >>> len(ep.ClosedChain.from_mjcf(chain.to_mjcf("robot")).closures)  # one a limb
    4
    """
    return write_files(folder, {f"{_stem(state)}.xml": mjcf_text(state, _closed_or_found(state, q))})[0]


def to_sdf(state: ChainState, folder: str | PathLike[str], q: ArrayLike | None = None) -> Path:
    """Write an SDF model in the configuration q and return its path.

    Parameters
    ----------
    folder, q
        As for :meth:`ClosedChain.to_mjcf`; the joints of the file are zero at q.

    Returns
    -------
    Path

    Raises
    ------
    InvalidInput
        See :func:`exo_pin.chain.formats.sdf.sdf_writing.sdf_text`.
    LoopNotClosed
        As for :meth:`ClosedChain.to_mjcf`.

    Examples
    --------
    >>> chain = ep.load("four-linear-actuators").chain_with_masses()
    >>> chain.to_sdf("gazebo").read_text().count("<joint name=")  # those of the tree and one a loop
    17
    """
    return write_files(folder, {f"{_stem(state)}.sdf": sdf_text(state, _closed_or_found(state, q))})[0]


def _closed_or_found(state: ChainState, q: ArrayLike | None) -> FloatArray:
    return close(state, reference_configuration(state)) if q is None else closed_configuration(state, q)


def _stem(state: ChainState) -> str:
    name = state.description.name
    return as_file_stem(name)
