"""What a run was for the person in the device, in numbers; doubts about its muscles, and stiff drives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...core.errors.base import ExoPinWarning, warn
from ...load_case.case import beyond_motion
from ...muscle.laws.static import BAR
from .drives import MuscleDrive

if TYPE_CHECKING:
    from .plant import Plant
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


#: Share by which pressures may exceed a limit, as of an integration.
_SLACK = 1e-3
#: Damping over critical damping from which a motion takes many steps, or long ones that are implicit.
_STIFF = 10.0


def muscle_cautions(run: Run) -> Iterator[str]:
    """Sentences on the muscles of a run; none for a plant without muscles."""
    muscles = [(i, drive) for i, drive in enumerate(run.plant.drives) if isinstance(drive, MuscleDrive)]
    inside, pulls = run.in_range, run.tensions > 0.0
    pulling = {f"muscle {i + 1}": inside[pulls[:, i], i] for i, _ in muscles if pulls[:, i].any()}
    every = np.concatenate([np.ones(0, dtype=bool), *pulling.values()])
    if not every.all():
        yield (
            f"The force laws of the muscles were identified in {_percent(every)} of the states in which they pull "
            f"({', '.join(f'{name}: {_percent(part)}' for name, part in pulling.items())}), and are extrapolated "
            "elsewhere."
        )
    for i, drive in muscles:
        most = float(run.pressures[:, i].max())
        if most > drive.supply_pressure * (1.0 + _SLACK):
            yield (
                f"Muscle {i + 1} reaches {most / BAR:.3g} bar, above its greatest safe pressure of "
                f"{drive.supply_pressure / BAR:.3g} bar: lower the supply."
            )


def warn_of_stiff_drives(plant: Plant) -> None:
    """Warn of drives that creep behind their limb: their motion decays faster by far than that of the arm."""
    found = {f"{drive.word} {i}": drive.damping_ratio for i, drive in enumerate(plant.drives, 1)}
    stiff = {name: ratio for name, ratio in found.items() if ratio > _STIFF}
    if stiff:
        warn(
            f"The damping of the spring is up to {max(stiff.values()):.3g} times critical in {', '.join(stiff)}: the "
            "run is right, and takes long. A damping_time is given in s, and is about 5e-4",
            ExoPinWarning,
        )


def _percent(met: NDArray[np.bool_]) -> str:
    """A share in percent, never rounded to all or to none."""
    share = 100.0 * float(met.mean())
    return f"{min(max(round(share), int(share > 0.0)), 100 - int(share < 100.0))} %"
