"""The wearer's skeleton and muscles in place of the mannequin, for a :class:`exo_pin.Person` (extra ``person``).

Bones are the meshes of the installed package ``myo_sim``. Muscles are drawn along their paths: straight between the
points where the model bends them, so that the picture shows the lines of action that the forces come from. Their
thickness follows from their volume; it is for the picture only. The other arm hangs at rest.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...core.records import OneProcess
from ...core.validation import FloatArray
from ...person.limb.muscle_table import MUSCLES
from ...person.limb.skeleton import BONES, LimbShape, bone_meshes, limb_shape
from ...reaction import GlenoidCone
from ..colours import ACTIVATIONS, BLACK, SKY, scale_colours
from ..stage.force_arrows import PoseContact, round_up
from ..stage.shapes import flat_material, lathe, matt_material, mesh_of, placement, segment, tube
from ..stage.stage import Stage, mg

if TYPE_CHECKING:
    from ...person import Person

_BONE, _OTHER_ARM = (0.90, 0.87, 0.80), (0.85, 0.83, 0.79)
#: Parts of a muscle along its path: tendons at the ends are thin, the belly is thick. Radius over the belly's.
_PROFILE = np.array([0.34, 0.42, 0.62, 0.84, 0.97, 1.0, 0.97, 0.84, 0.62, 0.42, 0.34])
#: Specific tension, N/m² (Saul 2015), and the share of a muscle's volume that is drawn, so that bones stay in sight.
_TENSION, _DRAWN = 50.8e4, 0.30
#: Least top of the scale of activations; radius of the ball where the force passes through the socket, m; thickness of
#: the ring over its radius, and its height over the depth of the socket; and what is drawn so small is hidden.
_LEAST_TOP, _BALL, _RIM, _FLAT, _HIDDEN = 0.05, 0.0035, 0.10, 0.4, 1e-6


class WearerFigure(OneProcess):
    """Bones and muscles of a person whose shoulder is at O and whose arm follows the pose.

    Parameters
    ----------
    stage : Stage
        Where they are drawn.
    person : Person
        Whose.

    Raises
    ------
    MissingExtra
        If the extra ``person`` is not installed.
    """

    PATH = "wearer"

    def __init__(self, stage: Stage, person: Person) -> None:
        self._stage, self._person = stage, person
        other = "right" if person.side == "left" else "left"
        viewer = stage.viewer[self.PATH]
        meshes, mirrored = bone_meshes(person.side), bone_meshes(other)
        for name in BONES:
            viewer[f"bones/{name}"].set_object(mg.TriangularMeshGeometry(*meshes[name]), matt_material(_BONE))
            if name != "trunk":
                mesh = mg.TriangularMeshGeometry(*mirrored[name])
                viewer[f"other_arm/{name}"].set_object(mesh, matt_material(_OTHER_ARM))
        pieces = [_piece(low, high) for low, high in itertools.pairwise(_PROFILE)]
        for muscle in MUSCLES:
            for k, piece in enumerate(pieces):
                viewer[f"muscles/{muscle}/{k}"].set_object(piece, mg.MeshLambertMaterial(side=0))
        viewer["socket/rim"].set_object(_ring(), flat_material(SKY, on_top=True))
        viewer["socket/force"].set_object(mg.Sphere(1.0), flat_material(BLACK, on_top=True))
        for part in ("rim", "force"):
            stage.set_property(f"/meshcat/{self.PATH}/socket/{part}", "renderOrder", 9)
        self.top = 1.0
        self._socket = np.eye(3), 0.0
        self._volume = person.muscle_table.volume / _TENSION
        self._rest = self._other_arm_at_rest()

    def show(self, matrix: FloatArray) -> None:
        """Move bones, muscles and the rim of the socket into a pose, shape (3, 3)."""
        person = self._person
        left = person.side == "left"
        angles, motion = (person.elbow_flexion, person.forearm_rotation), person.scapular_motion
        shape = limb_shape(matrix, *angles, person.length_scale, left, motion)
        root = f"/meshcat/{self.PATH}"
        for name, placed in shape.bones.items():
            self._stage.set_transform(f"{root}/bones/{name}", placed)
        # The trunk moves against the shoulder's centre, and the other arm with it.
        moved = shape.bones["trunk"][:3, 3] - self._rest["trunk"][:3, 3]
        for name, placed in self._rest.items():
            if name != "trunk":
                self._stage.set_transform(f"{root}/other_arm/{name}", placement(placed[:3, :3], placed[:3, 3] + moved))
        for muscle, path, volume in zip(MUSCLES, shape.paths, self._volume, strict=True):
            points, length = _resampled(path, len(_PROFILE))
            radius = np.sqrt(_DRAWN * volume / (np.pi * length * np.mean(_PROFILE**2)))
            for k in range(len(points) - 1):
                placed = segment(points[k], points[k + 1], radius)
                self._stage.set_transform(f"{root}/muscles/{muscle}/{k}", placed)
        self._show_socket(shape)

    @property
    def legend(self) -> list[dict[str, str]]:
        """What the ring at the socket is; the muscles have a bar of colours."""
        return [{"glyph": "ring", "colour": SKY, "text": "rim of the socket, and where the force passes"}]

    def plan(self, contacts: Sequence[PoseContact]) -> None:
        """Choose the top of the scale of activations for a pose or for all poses of a motion.

        It counts the arm without the device, so that colours show what the device takes over.
        """
        known = [each.most for each in contacts if np.isfinite(each.most)]
        self.top = min(max(round_up(max(known, default=1.0)), _LEAST_TOP), 1.0)

    def show_contact(self, contact: PoseContact | None) -> None:
        """Colour the muscles, grey where nothing is known, and mark where the force passes through the socket."""
        values = np.full(len(MUSCLES), np.nan) if contact is None else contact.activations
        for muscle, colour in zip(MUSCLES, scale_colours(values, 0.0, self.top, ACTIVATIONS), strict=True):
            self._stage.set_colour(f"/meshcat/{self.PATH}/muscles/{muscle}", [*colour, 1.0])
        axes, depth = self._socket
        ball = placement(_HIDDEN)
        if contact is not None and axes[0] @ contact.force > 0.0:
            ball = placement(_BALL, -depth * contact.force / (axes[0] @ contact.force))
        self._stage.set_transform(f"/meshcat/{self.PATH}/socket/force", ball)

    def _show_socket(self, shape: LimbShape) -> None:
        """Place the rim that the contact force stays inside: an ellipse in the plane of the socket."""
        outward, superior, anterior = shape.socket_axes
        depth = -float(outward @ shape.socket_centre)
        self._socket = shape.socket_axes, depth
        cone = GlenoidCone()
        ring = depth * np.column_stack([cone.anterior * anterior, cone.superior * superior, _FLAT * outward])
        self._stage.set_transform(f"/meshcat/{self.PATH}/socket/rim", placement(ring, -depth * outward))

    def _other_arm_at_rest(self) -> dict[str, FloatArray]:
        """Placements of the other arm's bones and of the trunk in the posture of rest."""
        person = self._person
        left = person.side == "left"
        own = limb_shape(np.eye(3), 0.0, 0.0, person.length_scale, left).bones
        other = limb_shape(np.eye(3), 0.0, 0.0, person.length_scale, not left).bones
        shift = own["trunk"][:3, 3] - other["trunk"][:3, 3]
        found = {name: placement(placed[:3, :3], placed[:3, 3] + shift) for name, placed in other.items()}
        # Both trunks are one.
        return found | {"trunk": own["trunk"]}


def _piece(low: float, high: float) -> Any:
    """A part of a muscle between z = 0 and 1, with rounded ends that reach into its neighbours."""
    below, above = [[_HIDDEN, -0.12], [0.8 * low, -0.08]], [[0.8 * high, 1.08], [_HIDDEN, 1.12]]
    return lathe(np.array([*below, [low, 0.0], [high, 1.0], *above]), 10)


def _ring() -> Any:
    """A round bar along the unit circle about z; its thickness is that of the rim on a socket of common size."""
    turn = np.linspace(0.0, 2 * np.pi, 49)
    return mesh_of([tube(np.column_stack([np.cos(turn), np.sin(turn), np.zeros(49)]), _RIM, 8)])


def _resampled(path: FloatArray, count: int) -> tuple[FloatArray, float]:
    """Points at equal steps along a path, shape (count, 3), and its length."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], count)
    return np.stack([np.interp(at, along, path[:, axis]) for axis in range(3)], axis=1), float(along[-1])
