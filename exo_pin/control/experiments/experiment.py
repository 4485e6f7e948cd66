"""An experiment: design, plant, reference, controller and faults, ready to run and to run again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...core.errors import InvalidInput, UnknownName
from ...core.errors.checked import checked
from ...core.records import Record
from ...core.validation import as_choice, as_positive, as_rotation, require_type, require_types, set_positive
from ...design import Mechanism
from ...device import Device
from ..controllers.model_controller import FeedbackGains, ModelController
from ..controllers.motor_loop import LengthController
from ..controllers.planning import planner_of
from ..controllers.thesis_controller import ContractionController
from ..imu import Imu, ImuSensor
from ..plant.any_device.arm_actions import Payload, Torso, Wearer
from ..plant.any_device.padding import Padding
from ..plant.drives import MuscleDrive
from ..plant.faults import Fault, as_faults
from ..plant.options import PlantOptions
from ..plant.plant import Plant
from ..plant.state import PlantState
from ..trajectories.reference import Reference
from .tracking import Tracking
from .tracking_report import default_controller, drive_kinds, foreseen

#: Controllers by name: PI of each limb by itself, and the one that knows the plant.
CONTROLLERS = ("pi", "model")
#: Samples a second with a fault of a motor-driven limb, Hz.
_FAULT_RATE = 1000.0


@checked
@dataclass(frozen=True, eq=False)
class Experiment(Record):
    """A design under a controller that follows a reference.

    Attributes
    ----------
    name, title : str
        Short name, and what it is.
    mechanism : Mechanism or Device
        The design, or any device, with an arm and drives.
    reference : Reference
        Where the arm shall be.
    controller : {"pi", "model"}, callable or None
        None for what suits the design: "model" of a redundant one, unless it states that it measures lengths alone,
        else "pi". "pi": of muscles the thesis's (:class:`exo_pin.control.ContractionController`), of motors
        :class:`exo_pin.control.LengthController`; "model": the one that knows the plant
        (:class:`exo_pin.control.ModelController`); or any function ``(t, measurement) -> commands``.
    options : PlantOptions
        Air, motors, friction, shoulder unit.
    duration : float or None
        s; that of the reference if None.
    imu : Imu or None
        The inertial sensor with its errors; None for exact measurements.
    faults : tuple of Fault
        Of muscles, valves and motors.
    rate : float
        Of the controller, Hz.
    feedback : FeedbackGains or None
        Of the controller "model".
    wearer : tuple of callable
        What the person does, as for :class:`.Plant`. Controllers do not know it.
    payloads : tuple of Payload
        What the arm carries for a time; controllers do not know it.
    torso, cuff, harness : Torso, Padding and Padding, or None
        How the torso moves, and how cuff and harness give way, as for :class:`.Plant`; controllers do not know it.
    source : str
        Where it comes from, and what is assumed.

    Examples
    --------
    >>> experiment = ep.experiment("four-cables-abduction")
    >>> len(experiment.mechanism.limbs), experiment.controller, experiment.reference.duration  # s
    (4, 'model', 5.0)
    """

    name: str
    title: str
    mechanism: Mechanism | Device
    reference: Reference
    controller: str | Callable[[float, Any], Any] | None = None
    options: PlantOptions = field(default_factory=PlantOptions)
    duration: float | None = None
    imu: Imu | None = None
    faults: tuple[Fault, ...] = ()
    rate: float = 100.0
    feedback: FeedbackGains | None = None
    wearer: tuple[Wearer, ...] = ()
    payloads: tuple[Payload, ...] = ()
    torso: Torso | None = None
    cuff: Padding | None = None
    harness: Padding | None = None
    source: str = ""

    def __post_init__(self) -> None:
        require_types(
            self,
            mechanism=Mechanism | Device,
            reference=Reference,
            options=PlantOptions,
            imu=Imu | None,
            feedback=FeedbackGains | None,
            torso=Torso | None,
            cuff=Padding | None,
            harness=Padding | None,
        )
        if self.controller is None:
            object.__setattr__(self, "controller", default_controller(self.mechanism))
        if isinstance(self.controller, str):
            as_choice("controller", self.controller, CONTROLLERS)
        else:
            require_type("controller", self.controller, Callable, "a name or a function")
        set_positive(self, "duration", optional=True)
        set_positive(self, "rate")
        motors = self.plant.motors.tolist() if self.faults else []
        object.__setattr__(self, "faults", as_faults(self.faults, motors, self.duration or self.reference.duration))

    def replace(self, **changes: Any) -> Experiment:
        """A copy with some fields changed; fields of :class:`PlantOptions` may be named, too.

        Parameters
        ----------
        **changes
            Fields of the class or of its options.

        Returns
        -------
        Experiment

        Raises
        ------
        UnknownName
            If a name is no field of either.

        Examples
        --------
        >>> experiment = ep.experiment("flexion").replace(duration=3.0, shoulder_coulomb=0.0)
        >>> experiment.duration, experiment.options.shoulder_coulomb
        (3.0, 0.0)
        """
        own, plant = {item.name for item in fields(self)}, {item.name for item in fields(PlantOptions)}
        unknown = sorted(set(changes) - own - plant)
        if unknown:
            raise UnknownName("field of an experiment", unknown[0], own | plant)
        options = changes.get("options", self.options)
        if isinstance(options, PlantOptions):
            options = options.replace(**{name: value for name, value in changes.items() if name in plant})
        return replace(self, **{name: value for name, value in changes.items() if name in own} | {"options": options})

    @cached_property
    def foreseen(self) -> tuple[str, ...]:
        """What can be said before it is run: poses that the drives cannot hold, or that lengths alone do not tell."""
        return foreseen(self)

    @property
    def plant(self) -> Plant:
        """The plant."""
        more = {name: getattr(self, name) for name in ("wearer", "payloads", "torso", "cuff", "harness")}
        return Plant(self.mechanism, self.options, **more)

    def made_controller(self, plant: Plant) -> Any:
        """The controller for a plant, reset if it can be.

        Parameters
        ----------
        plant : Plant
            What is run.

        Returns
        -------
        Controller

        Examples
        --------
        >>> experiment = ep.experiment("four-cables-abduction").replace(controller="pi")
        >>> plant = ep.Plant(experiment.mechanism, experiment.options)
        >>> type(experiment.made_controller(plant)).__name__  # of motors
        'LengthController'
        """
        if self.controller == "pi" and (plant.motors.any() or not plant.count):
            made: Any = LengthController(plant, self.reference, rate=self.rate)
        elif self.controller == "pi":
            layout = self.options.valves.layout
            made = ContractionController(plant.contractions, self.reference, rate=self.rate, layout=layout)
        elif self.controller == "model":
            made = ModelController(plant, self.reference, self.feedback, self.rate)
        else:
            made = self.controller
        if callable(getattr(made, "reset", None)):
            made.reset()
        return made

    def start(self, plant: Plant) -> PlantState:
        """The state that a run starts from.

        A design whose muscles are in line with their limbs starts at rest with vented muscles. Cables would hang loose
        there: a design with cables or linear actuators starts in the first pose of the reference, held by the tensions
        of least shoulder force.

        Parameters
        ----------
        plant : Plant
            What is run.

        Returns
        -------
        PlantState

        Raises
        ------
        InvalidInput
            If that pose is beyond the stroke of a limb.

        Examples
        --------
        >>> experiment = ep.experiment("four-cables-abduction")
        >>> state = experiment.start(ep.Plant(experiment.mechanism, experiment.options))
        >>> first = experiment.reference(0.0).orientation
        >>> round(float((state.orientation.inv() * first).magnitude()), 9)  # rad from the reference's first pose
        0.0
        """
        if plant.count and all(isinstance(drive, MuscleDrive) and not drive.over_tackle for drive in plant.drives):
            return plant.rest()
        plans = planner_of(plant)
        pose = plans.attained(self.reference)(0.0).orientation
        lengths = plans.lengths(pose)
        named = zip(plant.drives, drive_kinds(plant), lengths.tolist(), strict=True)
        for i, (drive, kind, length) in enumerate(named, 1):
            if drive.spans(length):
                continue
            size, unit = (180.0 / np.pi, "°") if kind == "turn" else (1e3, " mm")
            place, low, high = (f"{size * value:.0f}" for value in (length, drive.shortest, drive.longest))
            if kind != "limb":
                raise InvalidInput(
                    f"{drive.word} {i} would have to be at {place}{unit} at the start of the reference; it reaches "
                    f"{low} to {high}{unit}. Start elsewhere"
                )
            raise InvalidInput(
                f"limb {i} would have to be {place}{unit} long at the start of the reference; its "
                f"{drive.word} spans {low} to {high}{unit}. Start elsewhere"
            )
        least, greatest = plant.force_limits(lengths)
        return plant.held(pose, plans.tensions(pose, None, greatest, least, plant.load).tensions)

    def run(self, progress: bool = False) -> Tracking:
        """Run it from its :meth:`start`, recorded at the rate of the controller.

        Runs with faults of motor-driven limbs are recorded at 1 kHz at least: a cable that catches the arm does so
        within a hundredth of a second.

        Parameters
        ----------
        progress : bool
            Whether to show a bar.

        Returns
        -------
        Tracking
            Angles, lengths, pressures, tensions, shoulder force and energy; prints its verdict first.

        Raises
        ------
        InvalidInput
            If the reference does not return one orientation for each of several times.

        Examples
        --------
        >>> tracking = ep.experiment("flexion").replace(duration=0.1, rate=200.0).run()
        >>> len(tracking.run.times), tracking.run.status  # 0.1 s at 200 Hz
        (21, 'completed')
        """
        plant = self.plant
        duration = as_positive("duration", self.reference.duration if self.duration is None else self.duration)
        wanted = self.reference(np.array([0.0, duration])).orientation
        if as_rotation("orientation of the reference", wanted).shape != (2,):
            raise InvalidInput(f"expected a reference that returns one orientation a time, got {wanted.shape} for (2,)")
        sudden = bool(self.faults) and bool(plant.motors.any())
        sensor: Any = None if self.imu is None else ImuSensor(self.imu, plant.contractions)
        run = plant.simulate(
            self.made_controller(plant), duration, self.start(plant), self.rate, self.faults,
            sensor=sensor, sample_rate=max(self.rate, _FAULT_RATE) if sudden else self.rate, progress=progress,
        )  # fmt: skip
        return Tracking.of(self, run)
