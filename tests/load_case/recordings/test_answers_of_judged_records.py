"""What is said of recordings that may be read wrongly, and what is written of them, as it is stored."""

from dataclasses import replace
from unittest import mock

import foreign_records as foreign
import numpy as np
import planted_records as planted
from answers import changes, each_of
from asked_in_turn import folder, in_turn, words_and_numbers
from scipy.spatial.transform import Rotation

import exo_pin as ep


def judged():
    """Records of speeds, turns, starts, elbows and noise about the limits of a person's."""
    t, s = np.arange(121) / 40, np.sin(np.pi * np.arange(121) / 120) ** 2
    rng = np.random.default_rng(11)
    noise = rng.normal(size=(121, 3))

    def asked(angles, t=t, names=foreign.CLINICAL, column="time_s", side="left", movement=None, **options):
        rows = np.c_[t, np.broadcast_to(angles, (len(t), 3))].tolist()
        path = foreign.lines(place / "a.csv", [], (column, *names), rows)
        return ep.read_movement(path, side, smoothing=None, reading=ep.RecordingOptions(**options)).cautions

    def bent(share, turn, aside=180.0):
        """The elbow is bent for a share of the time, and seems to bend to where the trunk's sensor is turned."""
        truth = foreign.Truth(t, np.outer(s, [9, 2, 0]), "left", turn * (np.arange(121) > 121 * (1 - share)))
        with mock.patch("foreign_records.ON_TRUNK", foreign.ON_TRUNK * Rotation.from_euler("x", aside, degrees=True)):
            path, options = foreign.opensense(place, truth)
        own = ep.RecordingOptions(**options, still=0.1)
        return ep.read_movement(path, "left", smoothing=None, reading=own).cautions

    line, radians = np.array([80.0, 12.0, 5.0]), planted.in_radians(foreign.CLINICAL)
    with folder() as place:
        return in_turn(
            {
                "slow enough": lambda: asked(np.outer(s, line), 0.065 * t),
                "too fast": lambda: asked(np.outer(s, line), 0.045 * t),
                "faster as ms": lambda: asked(np.outer(s, line), t, column="time_ms"),
                "longer as s": lambda: asked(np.outer(s, line), 1e3 * t),
                "tiny": lambda: asked(np.outer(s, line) / 57.3),
                "tiny of a little": lambda: asked(np.outer(s, 0.3 * line) / 57.3),
                "tiny of less": lambda: asked(np.outer(s, 0.15 * line) / 57.3),
                "3.4 degrees": lambda: asked(np.outer(s, [3.4, 0, 0])),
                "3.2 degrees": lambda: asked(np.outer(s, [3.2, 0, 0])),
                "tiny and turned": lambda: asked(np.outer(s, [3.0, 0, 0]) - np.array([60, 0, 0])),
                "begins at 29": lambda: asked(np.outer(s, line), start=(29.0, 0, 0)),
                "begins at 31": lambda: asked(np.outer(s, line), start=(31.0, 0, 0)),
                "begins turned": lambda: asked(np.outer(s, line), start=(0, 0, 75)),
                "begins as radians": lambda: asked(np.outer(s, line) / 57.3 + [0.5, 0, 0], start=(29.0, 0, 0)),
                "raised": lambda: asked([95, 5, 0] - np.outer(s, [40, 0, 0])),
                "raised 99": lambda: asked([99, 5, 0] - np.outer(s, [40, 0, 0])),
                "raised 101": lambda: asked([101, 5, 0] - np.outer(s, [40, 0, 0])),
                "inverse, raised": lambda: asked(np.array([-120, 5, 0]) + np.outer(s, [120, 0, 0])),
                "few outside": lambda: asked(np.outer(np.where(s > 0.994, 1, 0.3 * s), [-70.0, 2, 0])),
                "more outside": lambda: asked(np.outer(np.where(s > 0.98, 1, 0.3 * s), [-70.0, 2, 0])),
                "a quarter outside": lambda: asked(np.outer(np.where(s > 0.83, 1, 0.3 * s), [-65.0, 2, 0])),
                "a third outside": lambda: asked(np.outer(np.where(s > 0.75, 1, 0.3 * s), [-65.0, 2, 0])),
                "noisy radians": lambda: asked(np.radians(np.outer(s, line)) + 0.03 * noise),
                "noisier radians": lambda: asked(np.radians(np.outer(s, line)) + 0.1 * noise),
                "thesis": lambda: asked(np.outer(s, [-75, 5, 5]), names=planted.THESIS[1:]),
                "isb": lambda: asked(
                    np.outer(s, [5, -80, 0]) + np.array([60, 0, 0]), names=planted.ISB[1:], side="right"
                ),
                "in degrees": lambda: asked(np.outer(s, line), names=radians),
                "as it is": lambda: asked(np.outer(s, -line), reading="as-named"),
                "minus": lambda: asked(np.outer(s, -line)),
                "nothing fits": lambda: asked(np.outer(s, [40, 0, 0]) + np.array([0, 0, 170])),
                "radians, just raised": lambda: asked(np.outer(s, line) / 57.3 + [1.77, 0, 0], names=radians),
                "radians, not raised": lambda: asked(np.outer(s, line) / 57.3 + [1.72, 0, 0], names=radians),
                "bent forward": lambda: bent(0.5, 60.0, 0.0),
                "bent backward": lambda: bent(0.5, 60.0),
                "seldom bent": lambda: bent(0.04, 60.0),
                "now and then": lambda: bent(0.06, 60.0),
                "bent less": lambda: bent(0.5, 29.5),
                "bent more": lambda: bent(0.5, 30.5),
                "74 aside": lambda: bent(0.5, 60.0, 74.0),
                "76 aside": lambda: bent(0.5, 60.0, 76.0),
                "-74 aside": lambda: bent(0.5, 60.0, -74.0),
                "-76 aside": lambda: bent(0.5, 60.0, -76.0),
            }
        )


def written():
    """Files of a movement in every convention, without the last digits of their numbers."""
    t = np.linspace(0.3, 1.4, 14)
    angles = np.stack([150.0 * t - 60.0, 40.0 * t, 175.0 + 12.0 * t])
    found = {}
    with folder():
        for side in ("left", "right"):
            movement = ep.Movement.from_samples(t, ep.shoulder_rotation(*angles, side, degrees=True), smoothing=None)
            bent = replace(movement, elbow_flexion=0.3 + 0.5 * t)
            cases = [("a.csv", movement, own) for own in ("thesis", "isb", "quaternions")] + [
                ("A.CSV", bent, "clinical")
            ]
            for name, own, kind in (
                *cases,
                ("a.mot", bent, "clinical"),
                ("b.mot", movement, "clinical"),
                ("a.sto", bent, "isb"),
            ):
                ep.write_movement(name, own, side, kind)
                with open(name, encoding="utf-8") as file:
                    found[f"{side} {name} {kind}"] = words_and_numbers(file.read().replace(",", " , "))
        found |= in_turn(
            {
                "no ending": lambda: ep.write_movement("a.txt", movement),
                "no angles": lambda: ep.write_movement("a.csv", movement, angles="euler"),
                "no side": lambda: ep.write_movement("a.csv", movement, "up"),
                "no movement": lambda: ep.write_movement("a.csv", movement.poses),
            }
        )
    return found


ASKED = {
    "judged": judged,
    "written": written,
}
LONGER = {"judged"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    assert not changes(__file__, name, ASKED[name])
