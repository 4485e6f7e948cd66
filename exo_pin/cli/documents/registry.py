"""Every document that commands and answers write, by the name of its schema."""

from __future__ import annotations

from pkgutil import resolve_name
from typing import Any

from ...core.schema import schema_of
from ...core.validation import as_choice

#: Module and record of each.
DOCUMENTS = {
    "reaction": "reaction.result:Reaction",
    "movement_reaction": "reaction.movement:MovementReaction",
    "pose": "cli.reaction_command:PoseDocument",
    "pose_report": "exo.pose_report:PoseReport",
    "joint_contact": "person.contact.result:JointContact",
    "contact_range": "person.contact.assumption_range:ContactRange",
    "force_uncertainty": "uncertainty.force_uncertainty:ForceUncertainty",
    "remedy": "reaction.holding.remedy:Remedy",
    "kinematics": "cli.kinematics_commands:Kinematics",
    "closed_configurations": "cli.kinematics_commands:ClosedConfigurations",
    "limb_state": "wrist.kinematics.inverse:LimbState",
    "drive_positions": "device.device_singularity:DrivePositions",
    "pose_accuracy": "device.accuracy.pose_accuracy:PoseAccuracy",
    "singularity": "wrist.singularities.measures:Singularity",
    "singular_pose": "cli.kinematics_commands:SingularPose",
    "device_singularity": "device.device_singularity:DeviceSingularity",
    "workspace_summary": "cli.search_commands:WorkspaceSummary",
    "optimised": "workspace.optimisation.optimised:Optimised",
    "study_table": "study.study_table:_StudyDocument",
    "design_report": "report.record:DesignReport",
    "parts": "cli.designs.parts_command:Parts",
    "report": "consistency.report:Report",
    "robot_forces": "cli.robot_commands:RobotForces",
    "track_summary": "cli.motion_commands:TrackSummary",
    "thesis": "cli.motion_commands:Thesis",
    "record_summary": "cli.recordings.record_command:RecordSummary",
    "batch_answer": "cli.documents.batch_command:BatchAnswer",
}


def kind_of(name: str) -> type:
    """The record of a document."""
    found: type = resolve_name(f"exo_pin.{DOCUMENTS[as_choice('schema', name, DOCUMENTS)]}")
    return found


def schema(name: str) -> dict[str, Any]:
    """JSON schema of the documents of this name."""
    return schema_of(kind_of(name), name)
