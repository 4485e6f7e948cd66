"""Spoiled arguments of calibration and trajectories: a typed error, or an answer that is finite or says infinite."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import control
from exo_pin.control.controllers.model_controller import gains_for
from exo_pin.design import Tackle

EXO = ep.load("prototype")


PLANT, OPTIONS, MECHANISM = ep.Plant(EXO), ep.PlantOptions(), EXO.mechanism
POSE, UNITS = Rotation.from_rotvec([0.1, -0.2, 0.3]), [control.PIGains(1.0, 1.0)]
LAYOUTS = ("3/2", "fill and vent", "3/2")
STUDY, UP, CABLES = ep.experiment("abduction"), control.abduction(), ep.experiment("four-cables-abduction")


@pytest.mark.parametrize(
    "call",
    [
        lambda: PLANT.state(angular_velocity="fast"),
        lambda: PLANT.simulate(None, 0.05),
        lambda: PLANT.simulate(lambda t, seen: [0.0] * 3, 0.05, faults=3),
        lambda: PLANT.simulate(lambda t, seen: [0.0] * 3, 0.05, sensor=3),
        lambda: PLANT.simulate(lambda t, seen: [0.0] * 3, 1e11),
        lambda: PLANT.simulate(lambda t, seen: [0.0] * 3, 0.05, rtol=0.1),
        lambda: PLANT.simulate(lambda t, seen: [0.0] * 3, 1.0, sample_rate=1e11),
        lambda: ep.PlantOptions(valves=3),
        lambda: ep.Plant(EXO, ep.PlantOptions(valves=[OPTIONS.valves] * 2)),
        lambda: STUDY.replace(valves=[replace(OPTIONS.valves, layout=each) for each in LAYOUTS]).run(),
        lambda: ep.Fault("burst", 0, end="never"),
        lambda: ep.Fault("burst", 0, end=[2.0, 3.0]),
        lambda: control.ContractionController(MECHANISM, UP, layout="4/2"),
        lambda: control.ContractionController(MECHANISM, 3),
        lambda: control.ContractionController(MECHANISM, UP, gains=3),
        lambda: control.ContractionController(EXO, UP),
        lambda: control.ModelController(EXO, UP),
        lambda: control.ModelController(PLANT, UP, gains=UNITS),
        lambda: control.ProportionalIntegral(3),
        lambda: control.ProportionalIntegral(UNITS).step([0.1], np.nan),
        lambda: control.ProportionalIntegral(UNITS).step([0.1], 0.0),
        lambda: control.tensions_for_motion(MECHANISM, POSE, None, [100.0, 100.0]),
        lambda: control.tensions_for_motion(MECHANISM, POSE, None, [np.nan, 100.0, 100.0]),
        lambda: control.tensions_for_motion(MECHANISM, Rotation.identity(2), None, np.full(3, 100.0)),
        lambda: control.Imu(lost=3),
        lambda: control.Imu(lost=(("a", "b"),)),
        lambda: control.Imu(lost=((2.0, 1.0),)),
        lambda: control.Imu(lost=((np.nan, 1.0),)),
        lambda: STUDY.replace(options=3),
        lambda: STUDY.replace(options=3, supply=ep.Supply(3e5)),
        lambda: STUDY.replace(faults=3),
        lambda: STUDY.replace(faults=ep.Fault("burst", 9)),
        lambda: STUDY.replace(rate=np.nan),
        lambda: STUDY.replace(feedback=3),
        lambda: STUDY.replace(faults=ep.Fault("no current", 0)),
        lambda: STUDY.replace(faults=np.array(1.0)),
        lambda: STUDY.replace(faults=ep.Fault("burst", 0, start=3.0), duration=3.0).run(),
        lambda: PLANT.simulate(lambda t, seen: [0.0] * 3, 0.05, PLANT.state(), faults=ep.Fault("torn", 0, start=0.1)),
        lambda: ep.PlantOptions(second_flange=np.nan),
        lambda: ep.PlantOptions(valves=np.array(1.0)),
        lambda: control.ContractionController(MECHANISM, UP, gains=np.array(1.0)),
        lambda: control.tensions_for_motion(EXO, POSE, None, np.full(3, 100.0)),
        lambda: control.reference_of(np.zeros((2, 2))),
        lambda: CABLES.replace(faults=ep.Fault("burst", 0)),
        lambda: CABLES.replace(faults=ep.Fault("torn", 4)),
        lambda: control.options_for(EXO),
        lambda: gains_for(EXO),
        lambda: control.FeedbackGains(air_ahead="yes"),
        lambda: control.LengthController(EXO, UP),
        lambda: PLANT.state("up"),
        lambda: PLANT.state(Rotation.identity(2)),
        lambda: PLANT.held(3, [1.0, 1.0, 1.0]),
        lambda: PLANT.held(POSE, [np.nan, 1.0, 1.0]),
        lambda: PLANT.force_limits([0.3, 0.3]),
        lambda: PLANT.force_limits([0.3, 0.3, np.nan]),
        lambda: PLANT.drive_states(np.full(3, 0.3), "tight"),
        lambda: PLANT.contractions.ratios([0.3, 0.3]),
        lambda: CABLES.plant.state(drive_positions=[np.nan] * 4),
        lambda: Tackle(2.0, 0.55, "tang-optimised", 4e5, count="two"),
        lambda: Tackle(2.0, 0.55, "tang-optimised", 4e5, count=np.nan),
    ],
)  # fmt: skip
def test_wrong_arguments_are_typed_errors(call):
    with pytest.raises(ep.ExoPinError):
        call()


def test_numbers_of_numpy_count_as_whole_numbers():
    fault, imu = ep.Fault("burst", np.int64(2)), control.Imu(seed=np.int64(3))
    assert (type(fault.limb), fault.limb, type(imu.seed), imu.seed) == (int, 2, int, 3)
    for limb in (True, 1.0, -1):
        with pytest.raises(ep.InvalidInput, match="limb"):
            ep.Fault("burst", limb)
