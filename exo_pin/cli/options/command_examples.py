"""What each command of ``exo-pin`` answers, and examples of it: the text of ``exo-pin COMMAND --help``."""

from __future__ import annotations

__all__ = ["DESCRIPTIONS", "EXAMPLES", "NOTES"]

#: Name of a command: what it answers, in plain sentences.
DESCRIPTIONS = {
    "reaction": "Compute the force on the shoulder and the forces in the limbs, in one pose of the arm or along a "
    "measured movement. The first lines say whether the device can hold the pose.",
    "plot": "Draw the mechanism with its forces in a pose, and a map of the shoulder force over flexion and abduction, "
    "as one picture.",
    "sweep": "Vary one or more parameters of a design and compare the results: one row for each combination, over a "
    "grid of poses of daily activities.",
    "singularity": "Show how far a pose is from a singular one, in which the limbs cannot resist a moment about some "
    "axis, and how much of daily life lies beyond the singular poses.",
    "presets": "List the designs that come with the package. Each name can be used wherever a command takes a design.",
    "check": "Check that a design is consistent: loops close, Jacobians agree with finite differences, masses and "
    "inertias are possible. The exit status is 1 if a check fails.",
    "export": "Write a design for other programs. Links without mass get small masses that the file marks as assumed, "
    "because simulators need them.",
    "mobility": "Count the degrees of freedom of a design or of any robot with closed loops, name redundant closures, "
    "and say how near a singular configuration is.",
    "forces": "Compute actuator efforts and joint reactions at rest, for a design or for any robot with closed loops, "
    "and say which of them equilibrium determines.",
    "person": "Compute the contact force in the shoulder joint with the wearer's own muscles, with the device and "
    "without it, in a pose or over the box of daily activities.",
    "contact": "The same as person: the contact force in the shoulder joint with the wearer's own muscles.",
    "calibrate": "Find joint centres and offsets of a device from measured poses and limb lengths, with their standard "
    "deviations and with what the measurements cannot determine.",
    "workspace": "Say which poses of a grid a design reaches, holds and keeps safe, and what each criterion costs.",
    "tasks": "Say how much of daily tasks a design reaches, from published ranges and from measured movements.",
    "optimise": "Search for a design that reaches and holds as many poses as it can. The search is stored, can be "
    "continued, and may be shared by several workers; the result is checked through Pinocchio.",
    "track": "Simulate the built machine with muscles, air, valves, sensor and controller: an experiment of the thesis "
    "by name, or a movement from a file.",
    "muscle": "Work with pneumatic muscles: forces, pressures, parameters from measurements, response to a step.",
    "view": "Show the design on a person with its forces, in three dimensions. Without --html or --png a live page is "
    "served on this machine until Ctrl-C.",
    "thesis": "List what the thesis prints beside what is computed here, with a verdict on every number.",
    "warm-up": "Compile all numerical functions now, so that later commands need not wait. It takes about a minute, "
    "once; nothing else changes.",
}

#: Name of a command: commands to begin with.
EXAMPLES = {
    "reaction": (
        "exo-pin reaction four-cables --flexion 60 --abduction 30",
        "exo-pin reaction prototype --person 1.75,75,male --payload 2 --flexion 45",
        "exo-pin reaction mine.toml --flexion 60 --compare",
        "exo-pin reaction four-cables --trajectory lift.csv --out forces.csv",
        "exo-pin reaction prototype --abduction 90 --approach way.png",
    ),
    "person": ("exo-pin person four-cables --flexion 60", "exo-pin person --bare --abduction 90 --range"),
    "contact": ("exo-pin contact four-cables --flexion 60",),
    "calibrate": ("exo-pin calibrate measured.csv prototype --length-noise 0.3 --out calibrated.toml",),
    "track": (
        "exo-pin track --list",
        "exo-pin track held-abduction --controller model --out run.csv --plot run.png",
        "exo-pin track lift.csv --design prototype --fault burst,3,4",
    ),
    "plot": ("exo-pin plot prototype --flexion 40 --out forces.png",),
    "sweep": (
        "exo-pin sweep prototype --vary r_A_mm=100:160:4",
        "exo-pin sweep prototype --vary r_A_mm=100,130 --vary alpha_A[2]_deg=50,60,70 --step 20 --out table.csv",
    ),
    "kinematics": ("exo-pin kinematics --flexion 30", "exo-pin kinematics --lengths 262.96,330.50,384.21"),
    "singularity": (
        "exo-pin singularity --abduction 60",
        "exo-pin singularity --abduction 90 --approach way.png --map map.png",
    ),
    "presets": ("exo-pin presets",),
    "check": ("exo-pin check mine.toml", "exo-pin check robot.urdf"),
    "export": (
        "exo-pin export four-cables --format mjcf --out exported",
        "exo-pin export mine.toml --format urdf --person 1.75,75,male",
    ),
    "mobility": ("exo-pin mobility prototype --abduction 90", "exo-pin mobility robot.urdf --set hip=0.4"),
    "forces": (
        "exo-pin forces prototype --flexion 45",
        "exo-pin forces robot.urdf --external tool=0,0,-20 --joint elbow",
    ),
    "workspace": (
        "exo-pin workspace four-cables",
        "exo-pin workspace mine.toml --person 1.75,75,male --out slices.png",
        "exo-pin workspace four-cables-worn --person 1.75,75,male --moving-centre",
    ),
    "tasks": ("exo-pin tasks four-cables", "exo-pin tasks four-cables --movement drinking=drinking.csv"),
    "optimise": (
        "exo-pin optimise --limbs 4 --family cable --person 1.75,75,male --budget 20000 --progress --out best.toml",
    ),
    "muscle": (
        "exo-pin muscle force --contraction-mm 20 --pressure-bar 2 4",
        "exo-pin muscle pressure --force-N 30 --contraction-mm 20",
    ),
    "view": (
        "exo-pin view four-cables --person 1.75,75,male --flexion 60 --open",
        "exo-pin view four-cables --to 90,0,0 --html lift.html",
    ),
    "thesis": ("exo-pin thesis", "exo-pin thesis --all"),
    "warm-up": ("exo-pin warm-up",),
}

#: Name of a command: what else its help says, line by line.
NOTES = {
    "reaction": """\
columns of --trajectory FILE, a CSV file with one header line:
  time_s                                              seconds, rising
  and one of
  flexion_deg, abduction_deg, internal_rotation_deg   clinical angles on the design's side (or ..._rad)
  theta_x_deg, theta_y_deg, theta_z_deg               angles of (4-7) in the thesis (or ..._rad)
  qx, qy, qz, qw                                      unit quaternion, arm to base frame
  such as
  time_s,flexion_deg,abduction_deg,internal_rotation_deg
  0.00,0.0,0.0,0.0
  0.02,0.3,0.0,0.0
""",
    "sweep": """\
columns of the table:
  peak, p95, median  shoulder force |F_s| over the poses that can be held, N
  holdable           share of the poses with an answer within the limits given
  pull_only          share that limbs which only pull can hold
  least_margin       smallest distance from a singular pose, dimensionless; it depends on the grid
  one_side           share on the more frequent side of the singular surface
  reach              share in which every limb is within its stroke
  A dash: not known for this design.
""",
}
