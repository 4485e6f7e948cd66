"""Closed chains from files of every format that is read."""

from __future__ import annotations

from collections.abc import Iterable
from os import PathLike
from typing import TYPE_CHECKING, Self

import pinocchio as pin

from .formats.mjcf.mjcf_reading import read_mjcf
from .formats.parallel_robots import read_parallel_robot
from .formats.sdf.sdf_reading import read_sdf
from .formats.urdf.urdf_loading import load_model
from .structure.description import Closures


class ReadChains:
    """How a :class:`exo_pin.ClosedChain` is read."""

    if TYPE_CHECKING:

        def __init__(self, model: pin.Model, closures: Closures) -> None: ...

    @classmethod
    def from_urdf(
        cls,
        urdf: str | PathLike[str],
        closures: Closures | str | PathLike[str] | None = None,
        root_joint: str | None = None,
        right_angle_tolerance: float = 0.0,
        leave_out: Iterable[str] = (),
    ) -> Self:
        """Load a chain.

        Parameters
        ----------
        urdf : path-like or str
            The file, or the XML itself.
        closures : Closures or path-like, optional
            What closes the loops; by default the file beside the URDF, ``robot.closures.toml`` for
            ``robot.urdf``. Where there is none the URDF is read as a tree.
        root_joint : str, optional
            How the root link hangs in the world, one of :data:`exo_pin.chain.ROOT_JOINTS`; by default that of the
            closures.
        right_angle_tolerance : float
            Angles ``rpy`` of the URDF this near a multiple of π/2 are read as that multiple, rad: 2e-5 for 1.5708,
            which tilts the axes of loops that are meant to be plane. Not above 0.01.
        leave_out : iterable of str
            "inertia_rules" reads inertias that no body has; ``description.left_out`` says what was left out.

        Returns
        -------
        ClosedChain

        Raises
        ------
        FileFormatError
            If the URDF or the closures file is not valid; the message names the place and line, see
            :mod:`exo_pin.chain.formats.urdf.urdf_checking`. Mimic joints become closures, see
            :mod:`exo_pin.chain.formats.urdf.urdf_mimic`.
        UnknownName
            If a root joint, frame, joint or closure type is not known.
        InvalidInput
            If data of a joint in the closures have another unit or number of components than the joint.

        Examples
        --------
        >>> mass = '<inertial><mass value="3"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        >>> urdf = f'<robot name="satellite"><link name="body">{mass}</link></robot>'
        >>> chain = ep.ClosedChain.from_urdf(urdf, root_joint="free_flyer")
        >>> chain.model.nq, chain.model.nv  # a position and a quaternion; a velocity and an angular velocity
        (7, 6)
        """
        return cls(*load_model(urdf, closures, root_joint, right_angle_tolerance, leave_out))

    @classmethod
    def from_parallel_robot(
        cls,
        path: str | PathLike[str],
        urdf: str | PathLike[str] | None = None,
        root_joint: str | None = None,
        right_angle_tolerance: float = 0.0,
        leave_out: Iterable[str] = (),
    ) -> Self:
        """Load a robot in the ``robot.yaml`` layout of toolbox-parallel-robots.

        See :func:`exo_pin.chain.formats.parallel_robots.read_parallel_robot`.

        Parameters
        ----------
        path : path-like
            The ``robot.yaml``.
        urdf : path-like, optional
            The URDF; that beside it if left out.
        root_joint : str, optional
            One of :data:`exo_pin.chain.ROOT_JOINTS`.
        right_angle_tolerance : float
            Angles this near a multiple of π/2, rad, are read as that.
        leave_out : iterable of str
            What to leave out of it.

        Returns
        -------
        ClosedChain

        Examples
        --------
        >>> from pathlib import Path
        >>> arms = '<body name="{0}"><joint name="{0}_hinge" axis="0 1 0"/><geom size="0.1" pos="0 0 1"/></body>'
        >>> bodies = arms.format("left") + arms.format("right")
        >>> urdf = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody>{bodies}</worldbody></mujoco>").to_urdf("robot")
        >>> loops = '{closed_loop: [["left", "right"]], type: ["6d"], name_mot: ["left_hinge"]}'
        >>> size = Path("robot/robot.yaml").write_text(loops)
        >>> chain = ep.ClosedChain.from_parallel_robot("robot", urdf)
        >>> chain.mobility([0.0, 0.0]).degrees_of_freedom  # the two arms move as one
        1
        """
        return cls(*read_parallel_robot(path, urdf, root_joint, right_angle_tolerance, leave_out))

    @classmethod
    def from_mjcf(cls, path: str | PathLike[str], leave_out: Iterable[str] = ()) -> Self:
        """Load a MuJoCo model whose loops are connect and weld equalities, from a file or from the XML itself.

        See :mod:`exo_pin.chain.formats.mjcf.mjcf_reading` for what is read and how it is named, and
        :func:`read_mjcf` there for what is raised. ``description.left_out`` says what was left out; what changes the
        motion and cannot be read is refused unless it is named in ``leave_out``.

        Parameters
        ----------
        path : path-like or str
            The file, or the XML itself.
        leave_out : iterable of str
            What to leave out of it.

        Returns
        -------
        ClosedChain

        Examples
        --------
        >>> rod = '<joint name="hinge" axis="0 1 0"/><inertial mass="2" pos="0 0 -0.5" diaginertia="1 1 1"/>'
        >>> chain = ep.ClosedChain.from_mjcf(f"<mujoco><worldbody><body>{rod}</body></worldbody></mujoco>")
        >>> chain.inverse_dynamics([np.pi / 2], actuated=["hinge"]).tau.round(3)  # N m hold it level: 2 kg at 0.5 m
        array([9.81])
        """
        return cls(*read_mjcf(path, leave_out))

    @classmethod
    def from_sdf(
        cls,
        path: str | PathLike[str],
        root_joint: str | None = None,
        right_angle_tolerance: float = 0.0,
        leave_out: Iterable[str] = (),
        first_joint: str | None = None,
    ) -> Self:
        """Load an SDF model, from a file or from the XML itself.

        See :mod:`exo_pin.chain.formats.sdf.sdf_reading`, and :func:`read_sdf` there for the arguments.

        Parameters
        ----------
        path : path-like or str
            The file, or the XML itself.
        root_joint : str, optional
            One of :data:`exo_pin.chain.ROOT_JOINTS`.
        right_angle_tolerance : float
            Angles this near a multiple of π/2, rad, are read as that.
        leave_out : iterable of str
            What to leave out of it.
        first_joint : str, optional
            A joint that is part of the tree and closes no loop, as the shoulder's of a device.

        Returns
        -------
        ClosedChain

        Examples
        --------
        >>> chain = ep.load("three-linear-actuators").chain_with_masses()
        >>> again = ep.ClosedChain.from_sdf(chain.to_sdf("robot"))
        >>> len(again.closures), again.mobility(again.close(again.neutral())).degrees_of_freedom
        (3, 3)
        """
        return cls(*read_sdf(path, root_joint, right_angle_tolerance, leave_out, first_joint))
