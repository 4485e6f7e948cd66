"""What an experiment yields: how well the arm followed, and what it cost."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_angles, thesis_angles
from ...core.errors.checked import checked
from ...core.files import write_columns
from ...core.results import Known, Result, drawn, taken_as_known
from ...core.validation import FloatArray, ReadOnly, as_choice
from ...muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE
from ..controllers.planning import planner_of
from ..plant.run import Run
from .tracking_report import SAME_POSE, continuous_angles, findings, holdable, known_of, lengths_in, verdict_of
from .tracking_table import columns_of, labelled, summary_of

if TYPE_CHECKING:
    from .experiment import Experiment


@checked
@dataclass(frozen=True, eq=False)
class Tracking(Result, ReadOnly):
    """An arm that followed a reference, at N instants, with n limbs.

    Attributes
    ----------
    experiment : Experiment
        What was run.
    run : Run
        The motion: times, rotations, lengths, pressures, tensions, energies.
    wanted : Rotation
        Stack of shape (N,): where the arm should have been.
    wanted_ratios, ratios : ndarray
        Contraction ratios (5-4), wanted and reached, shape (N, n).
    missing_moment : ndarray
        Shape (N,), N m: what the drives lack to hold the wanted pose at rest.

    Examples
    --------
    >>> tracking = ep.experiment("flexion").replace(duration=0.1).run()
    >>> bool((tracking.missing_moment > 0.0).all())  # N m: the prototype's muscles cannot hold any of these poses
    True
    """

    experiment: Experiment
    run: Run
    wanted: Rotation
    wanted_ratios: FloatArray
    ratios: FloatArray
    missing_moment: FloatArray

    @classmethod
    def of(cls, experiment: Experiment, run: Run) -> Tracking:
        """Compare a run with the reference of its experiment.

        Parameters
        ----------
        experiment : Experiment
            What was to be done.
        run : Run
            What was simulated.

        Returns
        -------
        Tracking
            At the times of the run, with the limbs of its plant.

        Examples
        --------
        >>> from exo_pin.control import Tracking
        >>> experiment = ep.experiment("abduction").replace(duration=0.1)
        >>> run = ep.Plant(experiment.mechanism, experiment.options).simulate(lambda t, seen: [1.0, 0.0, 0.0], 0.1)
        >>> round(float(np.rad2deg(Tracking.of(experiment, run).rms_error())), 1)  # degrees, of one's own controller
        14.5
        """
        wanted, plans = experiment.reference(run.times).orientation, planner_of(run.plant)
        ratios = run.plant.contractions.ratios(lengths_in(run.plant, wanted))
        return cls(experiment, run, wanted, ratios, run.contraction_ratios, plans.missing(wanted))

    @cached_property
    def wanted_lengths(self) -> FloatArray:
        """Coordinates of the drives in the wanted poses, shape (N, n): of a limb its length, m; in a joint m or rad."""
        return lengths_in(self.run.plant, self.wanted)

    @cached_property
    def attained(self) -> Rotation:
        """The wanted poses; of a device that turns the arm about fewer than three axes the nearest that it has."""
        return planner_of(self.run.plant).nearest(self.wanted)

    @property
    def times(self) -> FloatArray:
        """Shape (N,), s."""
        return self.run.times

    @property
    def error_vector(self) -> FloatArray:
        """Turn from the arm to where it should have been, rotation vector in the base frame, shape (N, 3), rad."""
        return np.asarray((self.wanted * self.run.rotations.inv()).as_rotvec())

    @property
    def error(self) -> FloatArray:
        """Angle of that turn, shape (N,), rad."""
        return np.asarray(np.linalg.norm(self.error_vector, axis=1))

    @property
    def reachable(self) -> np.ndarray:
        """Shape (N,), bool: whether the drives can hold the wanted pose at rest, within the strokes of motor drives."""
        return holdable(self.run.plant, self.wanted) & ((self.attained * self.wanted.inv()).magnitude() < SAME_POSE)

    def angles(self, wanted: bool = False, convention: str = "shoulder", degrees: bool = True) -> FloatArray:
        """Angles of the arm, or of the reference, over time.

        The first sample has the angles of :func:`exo_pin.shoulder_angles`; from there on they do not jump, so that an
        arm that is raised to 120° has 120° of abduction.

        Parameters
        ----------
        wanted : bool
            Whether of the reference.
        convention : {"shoulder", "thesis"}
            Flexion, abduction, internal rotation with clinical signs; or (θx, θy, θz) of (4-7).
        degrees : bool
            Whether to return degrees.

        Returns
        -------
        ndarray
            Shape (N, 3), degrees or rad.

        Examples
        --------
        >>> tracking = ep.experiment("flexion").replace(duration=0.1).run()
        >>> rise = np.diff(tracking.angles(wanted=True)[[0, -1], 0])[0] / 0.1
        >>> round(float(rise), 3)  # degrees a second: the reference takes 5 s for 90°
        18.0
        """
        pose = self.wanted if wanted else self.run.rotations
        if as_choice("convention", convention, ("shoulder", "thesis")) == "thesis":
            found = continuous_angles(thesis_angles(pose), 1.0)
        else:
            found = continuous_angles(shoulder_angles(pose, self.experiment.mechanism.side), -1.0)
        return np.degrees(found) if degrees else found

    @property
    def main_angle(self) -> int:
        """Which clinical angle the reference moves most: 0 flexion, 1 abduction, 2 internal rotation."""
        return int(np.ptp(self.angles(wanted=True), axis=0).argmax())

    @property
    def shoulder_force(self) -> FloatArray:
        """F_s, shape (N, 3), N, base frame, of the shoulder on the arm; limbs without side force."""
        return self.run.shoulder_force

    @property
    def air_energy(self) -> FloatArray:
        """Energy of the compressed air that was drawn, shape (N,), J: isothermal, m R T ln(p_supply/p_atmosphere)."""
        supply = ATMOSPHERE if self.run.plant.supply is None else self.run.plant.supply.absolute
        return np.asarray(self.run.air_used * GAS_CONSTANT * REFERENCE_TEMPERATURE * np.log(supply / ATMOSPHERE))

    @property
    def energy_in(self) -> FloatArray:
        """Energy that the drives took, shape (N,), J: compressed air and electric energy."""
        return np.asarray(self.air_energy + self.run.electric_energy.sum(axis=1))

    def rms_error(self, where: Any = None) -> float:
        """Root of the mean square of the error over the samples, rad; NaN without samples.

        Parameters
        ----------
        where : ndarray of bool, optional
            Shape (N,): which samples; all if left out.

        Returns
        -------
        float
            rad.

        Examples
        --------
        >>> tracking = ep.experiment("abduction").replace(duration=0.1).run()
        >>> first = tracking.run.times < 0.005
        >>> at_start = (tracking.run.rotations[0] * tracking.wanted[0].inv()).magnitude()
        >>> round(float(tracking.rms_error(first) / at_start), 9)  # of one sample: the angle between arm and reference
        1.0
        """
        chosen = self.error if where is None else self.error[where]
        return float(np.sqrt((chosen**2).mean())) if chosen.size else float("nan")

    def summary(self) -> dict[str, float]:
        """The run in numbers, with units in the keys; air, electricity and pushes only where there are such drives.

        Returns
        -------
        dict of str to float
            The unit ends the key: ``_deg``, ``_N``, ``_s``, ``_J``.

        Examples
        --------
        >>> numbers = ep.experiment("flexion").replace(duration=0.1).run().summary()
        >>> round(numbers["start_deg"], 1), round(numbers["peak_F_s_N"], 1)  # the dummy's arm hangs forward
        (13.0, 4.5)
        """
        return summary_of(self)

    @property
    def verdict(self) -> str:
        """What was taken as known, how the arm followed, and which limbs pass through the wearer."""
        return " ".join(part for part in (taken_as_known(self.known), verdict_of(self)) if part)

    @property
    def findings(self) -> tuple[str, ...]:
        """Why the arm did not follow, one sentence a reason."""
        return findings(self)

    @cached_property
    def without_faults(self) -> Tracking | None:
        """The run without faults and with its sensor throughout, made when it is asked for.

        None where nothing fails, or where the controller is a function, which may remember this run.
        """
        own, imu = self.experiment, self.experiment.imu
        fails = own.faults or (imu is not None and imu.lost)
        if not fails or not isinstance(own.controller, str):
            return None
        return own.replace(faults=(), imu=None if imu is None else replace(imu, lost=())).run()

    @cached_property
    def known(self) -> tuple[Known, ...]:
        """What the controller took as known, the mounting of the pose's sensor; effects at rest in the last pose."""
        return known_of(self)

    @property
    def cautions(self) -> tuple[str, ...]:
        """Of a measured reference, of the run and of what was foreseen; and that forces after a fault are estimates."""
        found = (*getattr(self.experiment.reference, "cautions", ()), *self.run.cautions, *self.experiment.foreseen)
        if not self.experiment.faults:
            return found
        text = "Forces after a fault depend on estimated data of the plant: repeat the run with other estimates."
        return (*found, text)

    def __str__(self) -> str:
        rows = (
            (labelled(key), f"{round(value, 9) + 0.0:.4g}" if np.isfinite(value) else "-")
            for key, value in self.summary().items()
        )
        lines = [f"{name:26} {number}" for name, number in rows]
        cautions = (f"Caution: {text}" for text in self.cautions)
        return "\n".join([self.verdict, *cautions, *(f"- {text}" for text in self.findings), "", *lines])

    def columns(self) -> dict[str, FloatArray]:
        """Everything over time, by name with its unit.

        Vectors are in the base frame. ``shoulder_moment`` is the moment of friction and stops of the shoulder unit on
        the arm. Without a load and with massless limbs the rows satisfy F_s = m (a_C - g) + Σ T_i s_i with
        a_C = η × C + ω × (ω × C). The gain of kinetic and potential energy is then ``tension_work_J`` less
        ``shoulder_loss_J``, and the work of a wearer. Drives that turn or slide in a joint have columns such as
        ``angle_1_rad`` and ``moment_1_N_m``, or ``position_1_m`` and ``force_1_N``, along the coordinate.

        Returns
        -------
        dict of str to ndarray
            Shape (N,) each.

        Examples
        --------
        >>> tracking = ep.experiment("abduction").replace(duration=0.1).run()
        >>> [name for name in tracking.columns() if name.endswith("_J")]  # the energies
        ['kinetic_energy_J', 'potential_energy_J', 'tension_work_J', 'shoulder_loss_J', 'energy_in_J']
        """
        return columns_of(self)

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write :meth:`columns` as CSV; verdict, cautions, findings and the moving mass stand in a JSON file beside it.

        Parameters
        ----------
        path : str or path-like
            The file to write; it appears whole or not at all.

        Examples
        --------
        >>> from pathlib import Path
        >>> ep.experiment("flexion").replace(duration=0.05).run().to_csv("run.csv")
        >>> len(Path("run.csv").read_text().splitlines()) - 1  # samples at 100 Hz, under the names of the columns
        6
        """
        write_columns(path, self.columns(), self.notes)

    @property
    def notes(self) -> dict[str, Any]:
        """What is to be known about the table: status, verdict, cautions, findings, and what moves."""
        tables = self.run.plant.tables
        return {
            "experiment": self.experiment.name,
            "status": self.run.status,
            "verdict": self.verdict,
            "cautions": list(self.cautions),
            "findings": list(self.findings),
            "moving_mass_kg": float(tables.mass),
            "centre_of_mass_mm": [1e3 * float(value) for value in tables.centre],
        }

    def plot(self) -> Any:
        """A page of plots: angles, contractions, pressures or motor forces, tensions, shoulder force.

        Returns
        -------
        matplotlib.figure.Figure

        Examples
        --------
        >>> page = ep.experiment("flexion").replace(duration=0.05).run().plot()
        >>> len(page.axes)
        6
        """
        return drawn("muscle_plots:tracking_figure", self)
