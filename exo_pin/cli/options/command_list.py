"""The commands of ``exo-pin``, each with its module and its line of help.

Only the module of the command that is called is imported: ``exo-pin --help`` and ``--version`` need no physics.
"""

from __future__ import annotations

__all__ = ["COMMANDS"]

#: Name of a command: the module of :mod:`exo_pin.cli` that has it, and its help.
COMMANDS = {
    "reaction": ("reaction_command", "forces on shoulder, limbs, cuff and torso in a pose"),
    "person": (
        "person.person_command",
        "force in the shoulder joint with the wearer's own muscles, with and without the device; their build",
    ),
    "contact": ("person.person_command", "the same as person"),
    "plot": ("plot_command", "picture of the mechanism with its forces, and a map of shoulder force"),
    "sweep": ("design.sweep_command", "vary parameters of a design and compare the results"),
    "kinematics": (
        "kinematics_commands",
        "lengths and joint angles in a pose, or all poses that fit measured lengths or angles",
    ),
    "singularity": ("kinematics_commands", "how near a pose is to a singular one, and which poses lie beyond"),
    "presets": ("design.design_commands", "designs that come with the package"),
    "check": (
        "design.design_commands",
        "kinematic consistency of a design, or of any robot with loops, from a .urdf, .xml or .sdf",
    ),
    "export": ("design.export_command", "write a design as URDF with its closures file, as MJCF or as SDF"),
    "calibrate": ("design.calibrate_command", "joint centres and offsets from measured poses and limb lengths"),
    "mobility": (
        "mobility_command",
        "freedoms, redundant closures, singular kinds and margins of a design or any robot",
    ),
    "forces": (
        "forces_command",
        "efforts and joint reactions of a design or any robot at rest, and which are determined",
    ),
    "workspace": (
        "search.workspace_command",
        "which poses a design reaches, holds and keeps safe",
    ),
    "tasks": ("search.workspace_command", "how much of daily tasks a design reaches"),
    "optimise": ("search.optimise_command", "search for a design that reaches and holds as many poses as it can"),
    "track": ("control.track_command", "the built machine in motion: the thesis's experiments, or a movement of yours"),
    "muscle": ("muscle.muscle_commands", "pneumatic muscles: force, pressure, identification, step response"),
    "view": ("view_command", "the design on a person, with its forces, in three dimensions"),
    "thesis": ("thesis_command", "what the thesis prints beside what is computed"),
    "warm-up": ("warm_up_command", "compile the kernels ahead of time (once, about a minute)"),
}
