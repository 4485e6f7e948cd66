"""ROS 2 messages as samples of a live stream, and its answers as ROS 2 messages: mappings alone, without ROS.

Messages are mappings with the names of their fields, as ``rosidl_runtime_py.message_to_ordereddict`` makes them and
recordings in JSON have them. Axes of REP 103 (x forward, y to the left, z up) are those of {O_A}.

========================================== =============================================================
``geometry_msgs/msg/QuaternionStamped``     a sample: the arm against the trunk, frame ``header.frame_id``
``sensor_msgs/msg/Imu``, two of them        a sample of sensors, on arm and trunk, to the ground
a live answer                               ``geometry_msgs/msg/WrenchStamped`` on the arm at the shoulder's centre
========================================== =============================================================
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..core.errors import InvalidInput

#: Times of two sensors that belong together may differ by so much, s.
_TOGETHER = 0.02


def time_of(header: Mapping[str, Any]) -> float:
    """Time of a header, s.

    Examples
    --------
    >>> from exo_pin.service.ros_messages import time_of
    >>> time_of({"stamp": {"sec": 3, "nanosec": 250000000}, "frame_id": "torso"})
    3.25
    """
    stamp = _field(header, "header", "stamp")
    return float(_field(stamp, "stamp", "sec")) + 1e-9 * float(_field(stamp, "stamp", "nanosec"))


def sample_of_quaternion(message: Mapping[str, Any], seq: int | None = None) -> dict[str, Any]:
    """A sample of a ``QuaternionStamped``: the arm's frame {O_B} seen from that of the trunk, ``header.frame_id``.

    Parameters
    ----------
    message : mapping
        The message.
    seq : int, optional
        Its number; ROS 2 messages have none, and lost ones are found by time where a stream states its rate.

    Raises
    ------
    InvalidInput
        If a field is missing.
    """
    time = time_of(_field(message, "message", "header"))
    return _numbered({"t": time, "quaternion_xyzw": _xyzw(message, "quaternion")}, seq)


def sample_of_imus(arm: Mapping[str, Any], trunk: Mapping[str, Any], seq: int | None = None) -> dict[str, Any]:
    """A sample of the ``Imu`` messages of two sensors, on the arm and on the trunk; its time is that of the arm's.

    Raises
    ------
    InvalidInput
        If a field is missing, a sensor gives no orientation (``orientation_covariance[0]`` of -1), or the two were not
        taken together.
    """
    times = [time_of(_field(each, "message", "header")) for each in (arm, trunk)]
    if abs(times[0] - times[1]) > _TOGETHER:
        raise InvalidInput(f"expected messages of one time, got {times[0]:.3f} and {times[1]:.3f} s")
    for name, each in (("arm", arm), ("trunk", trunk)):
        if _field(each, name, "orientation_covariance")[0] == -1.0:
            raise InvalidInput(f"the sensor on the {name} gives no orientation (orientation_covariance[0] is -1)")
    orientations = {"arm_xyzw": _xyzw(arm, "orientation"), "trunk_xyzw": _xyzw(trunk, "orientation")}
    return _numbered({"t": times[0], **orientations}, seq)


def wrench_of_answer(answer: Mapping[str, Any], frame_id: str) -> dict[str, Any]:
    """A ``WrenchStamped`` of a live answer: the force that the scapula puts on the arm at the shoulder's centre, N.

    A ball joint carries no moment: ``torque`` is zero. The stamp is the sample's to 0.2 µs: its time has been a float.

    Parameters
    ----------
    answer : mapping
        Of ``reaction`` its ``shoulder_force``, of ``joint_contact`` its ``joint_force``.
    frame_id : str
        The trunk's frame, whose axes those of the force are.

    Raises
    ------
    InvalidInput
        If the answer has no force: ROS has no null, and NaN would travel on.
    """
    force = answer.get("joint_force") or answer.get("shoulder_force")
    if not force or None in force:
        raise InvalidInput(f"this answer has no force: {answer.get('verdict', answer.get('detail', ''))}")
    seconds, nanoseconds = divmod(round(answer["t"] * 1e9), 10**9)
    vectors = {"force": dict(zip("xyz", force, strict=True)), "torque": dict.fromkeys("xyz", 0.0)}
    return {
        "header": {"stamp": {"sec": seconds, "nanosec": nanoseconds}, "frame_id": frame_id},
        "wrench": vectors,
    }


def _xyzw(message: Mapping[str, Any], name: str) -> list[float]:
    found = _field(message, "message", name)
    return [float(_field(found, name, part)) for part in "xyzw"]


def _numbered(sample: dict[str, Any], seq: int | None) -> dict[str, Any]:
    return sample if seq is None else {**sample, "seq": seq}


def _field(message: Mapping[str, Any], name: str, key: str) -> Any:
    if key not in message:
        raise InvalidInput(f"expected {key} in {name}, got {', '.join(message)}")
    return message[key]
