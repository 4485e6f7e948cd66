"""What a run was for the person in the device, in numbers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...load_case.case import beyond_motion

if TYPE_CHECKING:
    from .run import Run


def summary(self: Run) -> dict[str, float]:
    """What device, joint and person had to bear, with units in the keys.

    ``assistance`` is the share of :attr:`needed_moment` that the device carries: both moments multiplied and summed
    over the samples, so that a moment across the needed one is no help; 1 where the wearer does nothing. ``outside_s``
    is the time beyond the person's range of motion: that of the wearer's :class:`.JointStops`, else a usual one.
    The effort of the person's muscles needs a person: ``exo.joint_contact_of_run(run, person).effort``.

    Returns
    -------
    dict of str to float
        The unit ends the key: ``_N``, ``_N_m``, ``_W``, ``_J``, ``_s``.

    Examples
    --------
    >>> from exo_pin import control
    >>> exo, tissue = ep.load("four-cables"), control.Passive(2.0, 0.3, source="an assumption for this example")
    >>> plant = ep.Plant(exo, wearer=tissue)
    >>> run = plant.simulate(lambda t, seen: np.full(4, 0.1), 0.1, plant.held(exo.pose(30), np.full(4, 40.0)))
    >>> numbers = run.summary()
    >>> round(numbers["peak_wearer_moment_N_m"], 2), numbers["outside_s"]  # 2 N m/rad times 30°
    (1.05, 0.0)
    """
    needed, own = self.needed_moment, self.wearer_moment
    cuff, force = self.cuff_wrench, np.linalg.norm(self.shoulder_force, axis=1)
    power = np.einsum("ki,ki->k", cuff[:, 3:], self.angular_velocity)
    size = float((needed**2).sum())
    sizes = {"cuff_force_N": cuff[:, :3], "cuff_moment_N_m": cuff[:, 3:], "wearer_moment_N_m": own}
    found = {"mean_F_s_N": float(force.mean()), "peak_F_s_N": float(force.max())}
    found |= {f"peak_{name}": float(np.linalg.norm(part, axis=1).max()) for name, part in sizes.items()}
    return found | {
        "assistance": float((needed * cuff[:, 3:]).sum()) / size if size > 0.0 else 1.0,
        "peak_cuff_power_W": float(np.abs(power).max()),
        "device_work_J": float(self.tension_work[-1].sum() - self.tension_work[0].sum()),
        "wearer_work_J": float(self.wearer_work[-1] - self.wearer_work[0]),
        "electric_energy_J": float(self.electric_energy[-1].sum() - self.electric_energy[0].sum()),
        "outside_s": float(np.trapezoid(_outside(self).astype(float), self.times)),
    }


def _outside(run: Run) -> np.ndarray:
    """Whether the arm is beyond the person's range of motion, shape (N,)."""
    ends = [action for action in run.plant.wearer if hasattr(action, "depth")]
    if ends:
        return np.asarray(np.any([own.depth(run.rotations) > 0.0 for own in ends], axis=0))
    return np.asarray(beyond_motion(run.rotations.as_matrix(), run.plant.mechanism.side))
