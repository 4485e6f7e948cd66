"""Records of movements with known forces: clean ones, and ones with each fault that a sensor or a filter makes."""

import measured_movements as measured
import numpy as np
import scipy
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.load_case import Motion
from exo_pin.numerics.smoothing.smoothing_splines import continuous_quaternions


def _back_and_forth(t, duration):
    there = np.mod(t, 2 * duration)
    back = there >= duration
    poses, motion = measured.reach(np.where(back, 2 * duration - there, there), duration)
    return poses, Motion(np.where(back[:, None], -motion.angular_velocity, motion.angular_velocity),
                         motion.angular_acceleration)  # fmt: skip


def drawn(rng):
    """A movement as a function of time, and how long it lasts, s."""
    duration = rng.uniform(0.7, 1.5)
    pace, rest = rng.uniform(0.5, 1.5), rng.uniform(0.5, 1.0)
    return [
        (lambda t: measured.movement(t, pace), rng.uniform(2.0, 5.0)),
        (lambda t: measured.reach(t, 1.3 * duration), 1.3 * duration),
        (lambda t: measured.reach(np.clip(t - rest, 0.0, duration), duration), duration + 2 * rest),
        (lambda t: _back_and_forth(t, duration), 4 * duration),
    ][rng.integers(4)]


def _filtered(poses, keep):
    return Rotation.from_quat(keep(continuous_quaternions(poses)))


def _rounded(poses, decimals):
    return ep.shoulder_rotation(*np.round(ep.shoulder_angles(poses, degrees=True), decimals).T, degrees=True)


class Record:
    """A drawn movement, sampled at 50 to 200 Hz with noise of 0.03 to 1°."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.curve, duration = drawn(self.rng)
        self.rate = int(self.rng.choice([50, 100, 200]))
        self.noise = np.radians(10 ** self.rng.uniform(-1.5, 0))
        self.t = measured.sample_times(self.rng, self.rate, duration)
        self.poses, self.motion = self.curve(self.t)
        self.noisy = measured.noisy(self.rng, self.poses, self.noise)

    def clean(self):
        """Times and orientations of records without a fault, by name."""
        t, n = self.t, len(self.t)
        uneven = t + self.rng.uniform(-1 / 3, 1 / 3, n) / self.rate
        uneven = uneven[self.rng.random(n) > 0.05]
        return {
            "raw": (t, self.noisy),
            "exact": (t, self.poses),
            "rounded": (t, _rounded(self.poses, 2)),
            "noisy and rounded": (t, _rounded(self.noisy, 1)),
            "uneven": (uneven, measured.noisy(self.rng, self.curve(uneven)[0], self.noise)),
        }

    def doubtful(self, size):
        """Times and orientations of records with a fault, by name.

        ``size`` is |F_s| of the true movement: the gap is at its peak.
        """
        t, n, rate = self.t, len(self.t), self.rate
        low_pass = scipy.signal.butter(2, 8.0 / (rate / 2))
        slow, every = np.arange(n), max(2, rate // 20)
        frozen, middle = slow.copy(), int(np.linalg.norm(self.motion.angular_velocity, axis=1).argmax())
        frozen[middle : middle + max(4, rate // 12)] = middle
        there = np.abs(t - t[int(size.argmax())]) > 0.25
        there[[0, -1]] = True
        return {
            "filtered": (t, _filtered(self.noisy, lambda q: scipy.signal.filtfilt(*low_pass, q, axis=0))),
            "polynomial": (
                t, _filtered(self.noisy, lambda q: scipy.signal.savgol_filter(q, round(0.15 * rate) | 1, 3, axis=0))
            ),
            "slow sensor": (t, self.noisy[slow - slow % every]),
            "stands still": (t, self.noisy[frozen]),
            "gap": (t[there], self.noisy[there]),
        }  # fmt: skip
