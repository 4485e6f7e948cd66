"""MyoArm, the musculoskeletal model of the upper limb that a person's anatomy is taken from, compiled once.

MyoArm (package ``myo_sim``, Apache-2.0) has thorax, clavicle, scapula, humerus, ulna, radius and hand of a right arm,
and 63 muscles with paths that wrap around the bones. It is derived from the MoBL-ARMS model (Holzbaur et al. 2005,
doi 10.1007/s10439-005-3320-7; Saul et al. 2015). Clavicle and scapula follow the elevation of the arm by linear
couplings (scapulohumeral rhythm).

Facts about the model that matter here:

* It is a right arm. A left arm is its mirror image.
* The couplings and the counter-rotations of its massless bodies cancel exactly, so that the humerus turns against the
  thorax by three angles only: plane of elevation, elevation and axial rotation.
* Its axis of elevation is 3e-6 rad off the perpendicular to its axis of axial rotation. Here it is made perpendicular,
  so that the three angles reach every orientation.
* Its four glenohumeral ligaments have no stiffness: they carry no force. They do not count here either.
* It has no muscles between thorax and scapula. So the equilibrium of the scapula is not computed.
"""

from __future__ import annotations

import functools
import warnings
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...chain.formats.mjcf.mjcf_compiling import mujoco_warnings
from ...core.optional_packages import optional
from ...core.records import OneProcess, keeps_read_only
from ...core.validation import FloatArray, frozen
from .muscle_table import MUSCLES, data_table

_ELEVATION, _PLANE, _PLANE_BACK, _ROTATION = "shoulder_elv_r", "elv_angle_r", "shoulder1_r2_r", "shoulder_rot_r"
_ELBOW, _FOREARM = "elbow_flexion_r", "pro_sup_r"


@dataclass(frozen=True, eq=False)
class MyoArm(OneProcess):
    """The compiled model and the indices that are used of it.

    Vectors are in the frame of the model's thorax: x forward, y up, z to the right.

    Attributes
    ----------
    mujoco, model : module, mujoco.MjModel
        The package and the compiled model; neither is ever changed.
    root, scapula, humerus, ulna, radius : int
        Bodies.
    angles : ndarray of int
        Shape (6,): places in ``qpos`` of plane, elevation, plane back, rotation, elbow and forearm.
    coupled : ndarray of int
        Places in ``qpos`` of the joints that follow the elevation.
    coupling : ndarray
        Their angles over the elevation.
    limits : ndarray
        Shape (5, 2), rad: plane, elevation, rotation, elbow and forearm.
    vertical, elevation_axis : ndarray
        Shape (3,), unit vectors: axis of plane and axial rotation, and axis of elevation in the zero posture.
    tendons : ndarray of int
        Shape (m,): tendon of each muscle.
    path_sites : ndarray of int
        Sites of all tendons' paths, one after the other, with ``site_start`` of each tendon.
    site_start : ndarray of int
        Shape (tendons + 1,).
    in_arm, in_forearm, in_radius : ndarray of bool
        Shape (bodies,): humerus and what hangs from it; ulna and what hangs from it; radius and what hangs from it.
    """

    mujoco: Any
    model: Any
    root: int
    scapula: int
    humerus: int
    ulna: int
    radius: int
    angles: NDArray[np.int64]
    coupled: NDArray[np.int64]
    coupling: FloatArray
    limits: FloatArray
    vertical: FloatArray
    elevation_axis: FloatArray
    tendons: NDArray[np.int64]
    path_sites: NDArray[np.int64]
    site_start: NDArray[np.int64]
    in_arm: NDArray[np.bool_]
    in_forearm: NDArray[np.bool_]
    in_radius: NDArray[np.bool_]


@functools.cache
def myoarm(all_bones: bool = False) -> MyoArm:
    """The model, compiled at the first call of the process (under a second).

    Parameters
    ----------
    all_bones : bool
        Whether it has the meshes of the bones. Bodies have the same indices; their masses, which are not used, differ.

    Raises
    ------
    MissingExtra
        If ``myo_sim`` is not installed, or MuJoCo has a major version that it does not know.
    """
    mujoco, myo_sim = optional("person", "mujoco"), optional("person", "myo_sim")
    with mujoco_warnings(mujoco, []), warnings.catch_warnings():
        # A remark about empty prefixes, for those who write the model to a file.
        warnings.simplefilter("ignore")
        spec = myo_sim.load_spec("myoarm_r")
        axis = np.array(spec.joint(_PLANE).axis, dtype=np.float64)
        axis /= np.linalg.norm(axis)
        elevation = np.array(spec.joint(_ELEVATION).axis, dtype=np.float64)
        spec.joint(_ELEVATION).axis = elevation - elevation @ axis * axis
        if not all_bones:
            _drop_meshes(mujoco, spec)
        model = spec.compile()
    return _indexed(mujoco, model)


def _drop_meshes(mujoco: Any, spec: Any) -> None:
    """They are for pictures, and take most of the time of compiling."""
    for geom in list(spec.geoms):
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
            spec.delete(geom)
    for mesh in list(spec.meshes):
        spec.delete(mesh)


def mesh_of_geom(limb: MyoArm, geom: int) -> tuple[FloatArray, NDArray[np.int64]]:
    """Vertices of a mesh in the frame of its body, shape (v, 3), m, and triangles, shape (t, 3)."""
    mujoco, model = limb.mujoco, limb.model
    mesh = int(model.geom_dataid[geom])
    first, first_face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(np.float64)
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    vertices = vertices @ turn.reshape(3, 3).T + model.geom_pos[geom]
    return vertices, model.mesh_face[first_face : first_face + model.mesh_facenum[mesh]].astype(np.int64)


def _indexed(mujoco: Any, model: Any) -> MyoArm:
    bodies = {name: model.body(f"{name}_r").id for name in ("scapula", "humerus", "ulna", "radius")}
    names = (_PLANE, _ELEVATION, _PLANE_BACK, _ROTATION, _ELBOW, _FOREARM)
    joints = np.array([model.joint(name).id for name in names])
    with_elevation = model.eq_obj2id == joints[1]
    sites, start = _path_sites(mujoco, model)
    parts = {"in_arm": "humerus", "in_forearm": "ulna", "in_radius": "radius"}
    arrays: dict[str, Any] = {
        "angles": model.jnt_qposadr[joints].astype(np.int64),
        "coupled": model.jnt_qposadr[model.eq_obj1id[with_elevation]].astype(np.int64),
        "coupling": model.eq_data[with_elevation, 1],
        "limits": model.jnt_range[joints[[0, 1, 3, 4, 5]]],
        "vertical": model.jnt_axis[joints[0]].copy(),
        "elevation_axis": model.jnt_axis[joints[1]].copy(),
        "tendons": np.array([model.tendon(f"{name}_tendon").id for name in MUSCLES]),
        "path_sites": sites,
        "site_start": start,
        **{name: _hangs_from(model, bodies[body]) for name, body in parts.items()},
    }
    for array in arrays.values():
        frozen(array)
    return MyoArm(mujoco, model, model.body("myoarm_r_root").id, **bodies, **arrays)


def _path_sites(mujoco: Any, model: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sites of all paths in their order, and where each tendon's begin."""
    sites: list[int] = []
    start = [0]
    for tendon in range(model.ntendon):
        first = model.tendon_adr[tendon]
        items = slice(first, first + model.tendon_num[tendon])
        sites.extend(model.wrap_objid[items][model.wrap_type[items] == int(mujoco.mjtWrap.mjWRAP_SITE)].tolist())
        start.append(len(sites))
    return np.array(sites), np.array(start)


def _hangs_from(model: Any, body: int) -> NDArray[np.bool_]:
    """Which bodies are ``body`` or one of its descendants; parents stand before their children."""
    found = np.zeros(model.nbody, dtype=bool)
    for index in range(model.nbody):
        found[index] = index == body or (index > 0 and found[model.body_parentid[index]])
    return found


@keeps_read_only
class GlenoidSurface(NamedTuple):
    """The socket, in the scapula's frame of the model.

    ``python docs/scripts/glenoid_surface.py`` fits it to the mesh of the scapula. The joint surface has 34 triangles,
    is 36 mm high and 28 mm wide; the centre of the joint is 30.6 mm in front of its plane. Against the scapula the
    socket is turned 5.5° backwards; adults have 1 ± 3°. Its inclination is 0°, and -8 to +6° as the point at the level
    of the spine, which the mesh does not show clearly, is moved 15 mm down or up; adults have 7 ± 4° of the bone and
    1.6 ± 3° with the labrum.

    Attributes
    ----------
    centre : ndarray
        Shape (3,), m.
    axes : ndarray
        Shape (3, 3), rows: out of the socket, superior, anterior.
    """

    centre: FloatArray
    axes: FloatArray


@functools.cache
def glenoid_surface() -> GlenoidSurface:
    """The socket of the model's scapula."""
    rows = data_table("glenoid").numbers(("x", "y", "z"))
    return GlenoidSurface(rows[0], rows[1:])
