"""What can be said of a run before it: whether the drives can hold its poses, and whether lengths alone tell them.

A controller of lengths does not see the arm. Where the weakest rate is small, an error of a length turns the arm far;
where another pose has the same lengths, the arm may settle there, with every length right
(:mod:`exo_pin.device.accuracy`). A sensor of the arm's orientation sees both.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ...device.accuracy.pose_accuracy import pose_accuracy
from ...device.wrist_device import as_device
from ...reaction.holding.verdict import angle_words
from ..controllers.planning import HELD, planner_of
from ..plant.plant import Plant

if TYPE_CHECKING:
    from .experiment import Experiment

#: Poses of a reference that are looked at.
_SAMPLES = 25


def default_controller(mechanism: Any) -> str:
    """The controller of a design for which none is named.

    "model" of a redundant design, whose lengths do not say what each limb has to pull, unless the design states that
    it measures no more than lengths; "pi" else, as in the thesis.
    """
    measures = _measures(mechanism)
    sees = not measures or "arm" in measures
    return "model" if (mechanism.limb_count > 3 or not as_device(mechanism).has_limbs) and sees else "pi"


def foreseen(experiment: Experiment) -> tuple[str, ...]:
    """Sentences on a run before it is made; of a controller that is a function only on what the drives can hold."""
    mechanism, side = experiment.mechanism, experiment.mechanism.side
    measures = _measures(mechanism)
    end = experiment.reference.duration if experiment.duration is None else experiment.duration
    poses = experiment.reference(np.linspace(0.0, end, _SAMPLES)).orientation
    found = []
    lacking = ~holdable(experiment.plant, poses)
    if lacking.any():
        share, words = 100.0 * lacking.mean(), angle_words(poses[int(lacking.argmax())], side)
        found.append(
            f"the drives cannot hold {share:.0f} % of the wanted poses at rest, the first at {words}: the arm will "
            "not follow there"
        )
    if experiment.controller == "pi":
        seen = pose_accuracy(as_device(mechanism), poses)
        doubtful = seen.is_doubtful
        if doubtful.any():
            worst = int(np.where(doubtful, seen.rate, np.inf).argmin())
            found.append(
                f"lengths alone do not place the arm in {100.0 * doubtful.mean():.0f} % of the wanted poses; at "
                f"{angle_words(poses[worst], side)}, {seen.sensitivity(worst)}. A sensor of the arm's orientation "
                "does: --controller model"
            )
    elif experiment.controller == "model" and measures and "arm" not in measures:
        found.append(
            "the controller reads a sensor of the arm's orientation, which the design does not state (measures)"
        )
    return tuple(found)


def _measures(device: Any) -> Any:
    """What a wrist states that it measures; nothing of other devices."""
    record = as_device(device).accelerate("plant")
    return None if record is None else record.measures


def holdable(plant: Plant, poses: Rotation) -> NDArray[np.bool_]:
    """Shape (N,): whether the drives can hold a pose at rest, within the strokes of motor drives."""
    plans = planner_of(plant)
    lengths = np.array([plans.lengths(pose) for pose in poses]).reshape(len(poses), plant.count)
    held = plans.missing(poses) <= HELD
    for drive, length in zip(plant.drives, lengths.T, strict=True):
        if drive.is_motor:
            held &= drive.spans(length)
    return np.asarray(held)
