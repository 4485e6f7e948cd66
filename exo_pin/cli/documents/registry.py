"""Every document that commands and answers write, by the name of its schema."""

from __future__ import annotations

from pkgutil import resolve_name
from typing import Any

from ...core.schema import schema_of
from ...core.validation import as_choice
from ...exo.questions import ANSWERS

#: Module and record of each.
DOCUMENTS = {
    **ANSWERS,
    "movement_reaction": "reaction.movement:MovementReaction",
    "pose": "cli.reaction_command:PoseDocument",
    "pose_report": "exo.pose_report:PoseReport",
    "contact_range": "person.contact.assumption_range:ContactRange",
    "kinematics": "cli.kinematics_commands:Kinematics",
    "closed_configurations": "cli.kinematics_commands:ClosedConfigurations",
    "singular_pose": "cli.kinematics_commands:SingularPose",
    "optimised": "workspace.optimisation.optimised:Optimised",
    "total_uncertainty": "uncertainty.total_uncertainty:TotalUncertainty",
    "study_table": "study.study_table:_StudyDocument",
    "parts": "cli.designs.parts_command:Parts",
    "robot_forces": "cli.robot_commands:RobotForces",
    "track_summary": "cli.motion_commands:TrackSummary",
    "thesis": "cli.motion_commands:Thesis",
    "live_answer": "service.live_answers:LiveAnswer",
    "problem": "service.problems:Problem",
    "record_summary": "cli.recordings.record_command:RecordSummary",
}


def kind_of(name: str) -> type:
    """The record of a document."""
    found: type = resolve_name(f"exo_pin.{DOCUMENTS[as_choice('schema', name, DOCUMENTS)]}")
    return found


def schema(name: str) -> dict[str, Any]:
    """JSON schema of the documents of this name."""
    return schema_of(kind_of(name), name)
