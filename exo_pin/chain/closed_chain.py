"""A closed kinematic chain: a Pinocchio tree and what closes its loops."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..core.errors import InvalidInput
from ..core.validation import FloatArray
from .derivatives.dynamics_derivatives import DynamicsDerivatives
from .dynamics.simulation import Simulations
from .dynamics.tree_forces import Forces
from .formats.closures_file import closures_text, write_files
from .formats.mjcf.mjcf_reading import read_mjcf
from .formats.mjcf.mjcf_writing import mjcf_text
from .formats.parallel_robots import read_parallel_robot
from .formats.sdf_writing import sdf_text
from .formats.urdf.urdf_loading import load_model
from .formats.urdf.urdf_writing import urdf_text
from .kinematics.dependent_motion import Motions
from .kinematics.mobility import MobilityQueries
from .kinematics.paths import Paths
from .structure.description import Closures

__all__ = ["ClosedChain"]


class ClosedChain(MobilityQueries, Paths, Motions, Forces, DynamicsDerivatives, Simulations):
    """A kinematic tree with loop closures.

    Configurations q have shape (nq,), velocities and accelerations shape (nv,), as Pinocchio orders them; a
    spherical joint has a quaternion (x, y, z, w) in q and its body's angular velocity, in its own axes, in v.

    Constraint rows come closure by closure, rows in metres first. A closure between frame a and frame b is a
    projection of how a stands from b, (R_aᵀ (p_a - p_b), log(R_bᵀ R_a)) in the axes of a, as
    :mod:`exo_pin.chain.kinematics.projection` lists; its Jacobian rows are the same projection of the twist of a
    against b, in
    the axes of a, at p_b. **Multipliers** λ belong to these rows: they are the force (and moment about the closure's
    point p_b) that **the body of frame a receives** from the body of frame b, along the rows' directions, N and N m.
    Jᵀλ is the generalised force that they make; the body of frame b receives the opposite. Pinocchio's closure forces
    have this sign, too.

    One chain may be used from several threads at once: each thread has its own Pinocchio Data, and every array
    that is returned is the caller's. The model must not be changed.

    Parameters
    ----------
    model : pinocchio.Model
        The tree. It is kept, not copied.
    closures : Closures
        Its loops, roles and springs. The root joint, gravity and armatures that they name are not applied here;
        :meth:`from_urdf` does that.

    Raises
    ------
    UnknownName
        If a frame or joint of the closures is not in the model.
    """

    @classmethod
    def from_urdf(
        cls,
        urdf: str | PathLike[str],
        closures: Closures | str | PathLike[str] | None = None,
        root_joint: str | None = None,
    ) -> ClosedChain:
        """Load a chain.

        Parameters
        ----------
        urdf : path-like or str
            The file, or the XML itself.
        closures : Closures or path-like, optional
            What closes the loops; by default the file beside the URDF, ``robot.closures.toml`` for
            ``robot.urdf``.
        root_joint : str, optional
            How the root link hangs in the world, one of :data:`exo_pin.chain.ROOT_JOINTS`; by default what the
            closures say.

        Raises
        ------
        FileFormatError
            If a file cannot be read as what it should be: the URDF has an element or attribute that is unknown,
            missing or twice there, a number that is none or out of its range, an inertia that no body can have, links
            that are not one tree, or mimic joints (state them as closures). The message names the place and line; see
            :mod:`exo_pin.chain.formats.urdf.urdf_checking`.
        UnknownName
            If a root joint, frame, joint or closure type is not known.
        InvalidInput
            If data of a joint in the closures have another unit or number of components than the joint.
        """
        return cls(*load_model(urdf, closures, root_joint))

    @classmethod
    def from_parallel_robot(cls, path: str | PathLike[str], urdf: str | PathLike[str] | None = None) -> ClosedChain:
        """Load a robot in the ``robot.yaml`` layout of toolbox-parallel-robots.

        See :mod:`exo_pin.chain.formats.parallel_robots` for the layout, and :func:`read_parallel_robot` there for the
        arguments and for what is raised.
        """
        return cls(*read_parallel_robot(path, urdf))

    @classmethod
    def from_mjcf(cls, path: str | PathLike[str]) -> ClosedChain:
        """Load a MuJoCo model whose loops are connect and weld equalities, from a file or from the XML itself.

        See :mod:`exo_pin.chain.formats.mjcf.mjcf_reading` for what is read and how it is named, and
        :func:`read_mjcf` there for what is raised. Contact is not read.
        """
        return cls(*read_mjcf(path))

    def without_friction(self) -> ClosedChain:
        """The same chain without dry friction in its joints, on a copy of the model."""
        model = self._model.copy()
        none = np.zeros(model.nv)
        model.lowerDryFrictionLimit, model.upperDryFrictionLimit = none, none
        return ClosedChain(model, self._data_of_file)

    def to_urdf(self, folder: str | PathLike[str]) -> Path:
        """Write a URDF and the closures file beside it, both called after the chain, and return the URDF's path.

        See :func:`exo_pin.chain.formats.urdf.urdf_writing.urdf_text` for where damping, friction, limits, springs
        and armatures go, and for what is raised. Pictures are not kept.
        """
        text, closures = urdf_text(self)
        stem = self._stem()
        more = ", its springs and armatures" if closures.joints else ""
        note = f"What {stem}.urdf leaves out: its root, its loops, its roles{more}. Written by exo_pin."
        files = {f"{stem}.urdf": text, f"{stem}.closures.toml": closures_text(closures, note)}
        return write_files(folder, files)[0]

    def to_mjcf(self, folder: str | PathLike[str], q: ArrayLike | None = None) -> Path:
        """Write a MuJoCo model and return its path.

        Parameters
        ----------
        folder : path-like
            Where to; made if it is not there.
        q : array_like, optional
            Shape (nq,), the configuration of the keyframe "closed"; found from the rest configuration if left out.

        Raises
        ------
        InvalidInput
            See :func:`exo_pin.chain.formats.mjcf.mjcf_writing.mjcf_text`.
        LoopNotClosed
            If q is open, or none is given and the loops do not close.
        """
        return write_files(folder, {f"{self._stem()}.xml": mjcf_text(self, self._closed_or_found(q))})[0]

    def to_sdf(self, folder: str | PathLike[str], q: ArrayLike | None = None) -> Path:
        """Write an SDF model as it stands at q and return its path.

        Parameters
        ----------
        folder, q
            As for :meth:`to_mjcf`; the file stands at q, where its joints read zero.

        Raises
        ------
        InvalidInput
            See :func:`exo_pin.chain.formats.sdf_writing.sdf_text`.
        LoopNotClosed
            As for :meth:`to_mjcf`.
        """
        return write_files(folder, {f"{self._stem()}.sdf": sdf_text(self, self._closed_or_found(q))})[0]

    def _closed_or_found(self, q: ArrayLike | None) -> FloatArray:
        return self.close(self.neutral()) if q is None else self._closed(q)

    def _stem(self) -> str:
        name = self.description.name
        if Path(name).name != name:
            raise InvalidInput(f"expected a chain whose name can name a file, got {name!r}")
        return name

    def __repr__(self) -> str:
        return (
            f"<ClosedChain {self.description.name!r}: {self._model.nv} coordinates, "
            f"{len(self.closures)} closures with {self.row_count} rows>"
        )
