"""What an experiment yields: how well the arm followed, and what it cost."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.conventions import shoulder_angles, thesis_angles
from ...core.files import write_text
from ...core.files.csv_tables import csv_text
from ...core.pictures import drawn
from ...core.records import Record
from ...core.validation import FloatArray, as_choice, frozen
from ...muscle.valve.flow import ATMOSPHERE, GAS_CONSTANT, REFERENCE_TEMPERATURE
from ..controllers.contraction import Contractions
from ..plant.equations.plant_tables import supply_of
from ..plant.run import Run
from .continuous_angles import continuous_angles
from .findings import ANGLES, findings
from .holdable import HELD, missing_moments

if TYPE_CHECKING:
    from .experiment import Experiment

__all__ = ["Tracking"]


@dataclass(frozen=True, eq=False)
class Tracking(Record):
    """An arm that followed a reference, at N instants, with n muscles.

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
        Shape (N,), N m: what the muscles lack to hold the wanted pose at rest.
    """

    experiment: Experiment
    run: Run
    wanted: Rotation
    wanted_ratios: FloatArray
    ratios: FloatArray
    missing_moment: FloatArray

    @classmethod
    def of(cls, experiment: Experiment, run: Run) -> Tracking:
        """Compare a run with the reference of its experiment."""
        contractions = Contractions(experiment.mechanism)
        wanted = experiment.reference(run.times).orientation
        return cls(
            experiment,
            run,
            wanted,
            frozen(contractions.ratios(contractions.lengths(wanted))),
            frozen(contractions.ratios(run.lengths)),
            frozen(missing_moments(run.plant, wanted)),
        )

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
        """Shape (N,), bool: whether the muscles can hold the wanted pose at rest."""
        return self.missing_moment <= HELD

    def angles(self, wanted: bool = False, convention: str = "shoulder", degrees: bool = True) -> FloatArray:
        """Angles of the arm, or of the reference, over time.

        The first sample has the angles of :func:`exo_pin.shoulder_angles`; from there on they do not jump, so that an
        arm that is raised to 120° has 120° of abduction.

        Parameters
        ----------
        wanted : bool
            Of the reference.
        convention : {"shoulder", "thesis"}
            Flexion, abduction, internal rotation with clinical signs; or (θx, θy, θz) of (4-7).
        degrees : bool
            Whether to return degrees.

        Returns
        -------
        ndarray
            Shape (N, 3).
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
        supply = supply_of(self.experiment.mechanism, self.run.plant.options).absolute
        return np.asarray(self.run.air_used * GAS_CONSTANT * REFERENCE_TEMPERATURE * np.log(supply / ATMOSPHERE))

    def rms_error(self, where: Any = None) -> float:
        """Root of the mean square of the error over the samples, rad; NaN without samples.

        Parameters
        ----------
        where : ndarray of bool, optional
            Shape (N,): which samples; all if left out.
        """
        chosen = self.error if where is None else self.error[where]
        return float(np.sqrt((chosen**2).mean())) if chosen.size else float("nan")

    def summary(self) -> dict[str, float]:
        """The run in numbers, with units in the keys."""
        main, wanted = self.angles()[:, self.main_angle], self.angles(wanted=True)[:, self.main_angle]
        force, ahead = np.linalg.norm(self.shoulder_force, axis=1), wanted - wanted[0]
        # Backward, too: an extension, or an arm that is lowered.
        way = -1.0 if ahead[np.abs(ahead).argmax()] < 0.0 else 1.0
        return {
            "start_deg": float(main[0]),
            "end_deg": float(main[-1]),
            "wanted_end_deg": float(wanted[-1]) + 0.0,
            "furthest_deg": float(way * (way * main).max()),
            "rms_error_deg": float(np.degrees(self.rms_error())),
            "reachable_share": float(self.reachable.mean()),
            "rms_error_reachable_deg": float(np.degrees(self.rms_error(self.reachable))),
            "peak_F_s_N": float(force.max()),
            "mean_F_s_N": float(force.mean()),
            "end_F_s_N": float(force[-1]),
            "peak_tension_N": float(self.run.tensions.max()),
            "muscle_work_J": float(self.run.muscle_work[-1].sum()),
            "air_energy_J": float(self.air_energy[-1]),
            "air_used_g": float(1e3 * self.run.air_used[-1]),
        }

    @property
    def verdict(self) -> str:
        """One plain sentence."""
        numbers, name = self.summary(), ANGLES[self.main_angle]
        if self.run.status != "completed":
            end = f"the run {self.run.status}"
        else:
            # Rounded, and added to zero: no minus before a zero.
            reached, wanted = (round(numbers[key]) + 0 for key in ("end_deg", "wanted_end_deg"))
            end = f"{name} ends at {reached}° of {wanted}°"
        return (
            f"{self.experiment.title}: {end}, off by {numbers['rms_error_deg']:.1f}° (rms); "
            f"|F_s| up to {numbers['peak_F_s_N']:.0f} N."
        )

    @property
    def findings(self) -> tuple[str, ...]:
        """Why the arm did not follow, one sentence a reason."""
        return findings(self)

    def __str__(self) -> str:
        rows = (
            (key.replace("_", " "), f"{value:.4g}" if np.isfinite(value) else "-")
            for key, value in self.summary().items()
        )
        lines = [f"{name:26} {number}" for name, number in rows]
        return "\n".join([self.verdict, *(f"- {finding}" for finding in self.findings), "", *lines])

    def columns(self) -> dict[str, FloatArray]:
        """Everything over time, by name with its unit."""
        table: dict[str, FloatArray] = {"time_s": self.times}
        for wanted, prefix in ((True, "wanted_"), (False, "")):
            for name, values in zip(ANGLES, self.angles(wanted).T, strict=True):
                table[f"{prefix}{name.replace(' ', '_')}_deg"] = values
        table["error_deg"] = np.degrees(self.error)
        run = self.run
        series = (
            ("length_{}_m", run.lengths), ("wanted_ratio_{}", self.wanted_ratios), ("ratio_{}", self.ratios),
            ("command_{}", run.commands), ("pressure_{}_Pa", run.pressures), ("tension_{}_N", run.tensions),
        )  # fmt: skip
        for name, values in series:
            table |= {name.format(i): column for i, column in enumerate(values.T, 1)}
        table |= {f"F_s_{axis}_N": part for axis, part in zip("xyz", self.shoulder_force.T, strict=True)}
        table |= {
            "F_s_N": np.linalg.norm(self.shoulder_force, axis=1),
            "kinetic_energy_J": run.kinetic_energy,
            "potential_energy_J": run.potential_energy,
            "muscle_work_J": run.muscle_work.sum(axis=1),
            "air_energy_J": self.air_energy,
        }
        return table

    def to_csv(self, path: str | PathLike[str]) -> None:
        """Write :meth:`columns` as a CSV file, the verdict as its first comment. Whole or not at all."""
        table = self.columns()
        rows = ([format(value, ".9g") for value in row] for row in zip(*table.values(), strict=True))
        write_text(path, csv_text(table, rows, [self.verdict, *self.findings]))

    def plot(self) -> Any:
        """A page of plots: angles, contraction ratios, pressures, tensions, shoulder force.

        Returns
        -------
        matplotlib.figure.Figure
        """
        return drawn("tracking_figure", self)
