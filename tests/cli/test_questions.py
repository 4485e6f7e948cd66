"""Questions of a designer on the command line, and what a person has to read in the answer."""

import numpy as np
import pytest
from command_line import run

import exo_pin as ep

PERSON = ["--person", "1.75,75,male"]


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A movement, a design of points with bare limbs, and an exported robot."""
    folder = tmp_path_factory.mktemp("questions")
    times = np.linspace(0.0, 2.0, 41)
    lines = [f"{t:.3f},{30 * t:.5f},{20 * np.sin(t):.5f},0" for t in times]
    header = "time_s,flexion_deg,abduction_deg,internal_rotation_deg"
    (folder / "lift.csv").write_text("\n".join([header, *lines]) + "\n")
    angles = np.radians([0.0, 72.0, 144.0, 216.0, 288.0])
    ring = np.stack([np.cos(angles), np.sin(angles), np.zeros(5)], axis=1)
    geometry = ep.WristGeometry(0.15 * ring + [0, 0, 0.1], 0.1 * ring[:, [1, 0, 2]] + [0, 0, -0.2])
    ep.ShoulderExo(geometry, arm=ep.Arm.from_anthropometry(1.7, 70, "female")).save(folder / "points.toml")
    ep.load("prototype").to_urdf(folder)
    return folder


#: Arguments, exit status, and what stands in the answer in this order.
QUESTIONS = {
    "a pose": (
        ["reaction", "four-cables", "--flexion", "60"],
        0,
        [
            "YES, it holds.",
            "flexion 60°",
            "% of body weight, on the head: ",
            "limb 1 pulls",
            "four-cables",
            "More: --explain",
        ],
    ),
    "a pose that the prototype cannot take": (
        ["reaction", "prototype", "--flexion", "60", "--abduction", "30", *PERSON],
        0,
        [
            "NO, it cannot hold.",
            "Limbs 1 and 3 would have to push",
            "39 mm too short",
            "No pose within 60° can be held",
            "cannot push",
        ],
    ),
    "a script that needs a yes": (
        ["reaction", "prototype", "--flexion", "60", "--require-hold"],
        1,
        ["NO, it cannot hold."],
    ),
    "a script that gets its yes": (["reaction", "four-cables", "--require-hold"], 0, ["YES, it holds."]),
    "a movement": (
        ["reaction", "four-cables", "--trajectory", "lift.csv"],
        0,
        ["41 samples", "peak N", "noise", "status: 41 ok"],
    ),
    "the other side": (
        ["reaction", "four-cables", "--side", "right", "--flexion", "45"],
        0,
        ["YES, it holds.", "right arm"],
    ),
    "a heavier person with a payload": (
        ["reaction", "four-cables", "--person", "1.9,110,male", "--payload", "2", "--flexion", "90"],
        0,
        ["YES, it holds.", "1.9 m, 110 kg, 2 kg in the hand"],
    ),
    "a design of points without limbs": (
        ["reaction", "points.toml", "--flexion", "20"],
        0,
        ["NOT KNOWN whether it holds.", "Not known: stroke of limbs 1, 2, 3, 4 and 5"],
    ),
    "a robot from a URDF": (["mobility", "prototype.urdf"], 0, ["degrees of freedom", "3", "redundant rows"]),
    "a singular pose": (
        ["reaction", "prototype", "--abduction", "90"],
        0,
        ["NO, it cannot hold.", "It is singular, and the limbs cannot resist a moment about the sideways axis"],
    ),
    "a singular pose in numbers": (["singularity", "prototype", "--abduction", "90"], 0, ["singular", "without bound"]),
    "a pose beside a singular one": (
        ["reaction", "prototype", "--abduction", "6.2"],
        0,
        [
            "Almost singular",
            "a singular pose is 0.0095° away",
            "on the head",
        ],
    ),
    "an angle in radians": (["reaction", "prototype", "--flexion", "1.0471975511965976"], 0, ["is 60° in radians"]),
    "radians with two digits": (["reaction", "prototype", "--flexion", "1.57"], 0, ["is 90° in radians"]),
    "a payload in newtons": (
        ["reaction", "four-cables", *PERSON, "--payload", "20"],
        0,
        ["20 kg weighs 196 N", "(newtons?)"],
    ),
    "an offset in metres": (["reaction", "four-cables", "--offset", "0.01", "0", "0"], 0, ["takes mm (metres?)"]),
    "lengths in metres": (["kinematics", "prototype", "--lengths", "0.245,0.303,0.381"], 2, ["in mm", "(metres?)"]),
    "a negative mass": (["reaction", "prototype", "--person", "1.75,-75,male"], 2, ["mass to be above zero", "-75"]),
    "half a turn too much": (["reaction", "prototype", "--flexion", "200"], 0, ["beyond half a turn"]),
    "a pose of the other side": (
        ["reaction", "prototype", "--side", "right", "--abduction", "-80"],
        0,
        ["a left shoulder does"],
    ),
    "a height in centimetres": (
        ["reaction", "prototype", "--person", "175,75,male"],
        2,
        ["0.5 to 2.6 m", "did you mean 1.75 m?"],
    ),
    "a misspelt design": (["reaction", "four-cabels"], 2, ["did you mean 'four-cables'"]),
    "the assumptions side by side": (
        ["reaction", "prototype", "--flexion", "40", "--compare"],
        0,
        ["cannot hold", "spherical", "minimal", "standalone"],
    ),
    "misalignment": (
        ["reaction", "four-cables", "--flexion", "40", "--offset", "10", "-5", "0"],
        0,
        ["YES, it holds.", "device off by (10, -5, 0) mm"],
    ),
    "tensions out of a drive's reach": (
        ["reaction", "four-cables", "--flexion", "90", "--limits", "0,20", "--explain"],
        0,
        ["The device cannot hold this pose", "is missing.", "Limb 1 is at its greatest force, 20.0 N"],
    ),
    "the workspace": (
        ["workspace", "four-cables", "--step", "20"],
        0,
        ["of 216 poses are inside", "forces", "not checked, because not known"],
    ),
    "a sweep": (
        ["sweep", "prototype", "--vary", "r_A_mm=100,130", "--step", "30"],
        0,
        [
            "No design holds any",
            "both sides of the singular surface",
            "compare median_F_s_N",
            "r_A_mm",
            "peak_F_s_N",
            "100",
            "130",
        ],
    ),
    "another program": (
        ["export", "prototype", "--out", "prototype.xml"],
        0,
        ["prototype.xml", "keyframe closed"],
    ),
}


@pytest.mark.parametrize("question", QUESTIONS)
def test_the_answer_says_what_a_person_needs(question, files, monkeypatch, capsys):
    arguments, expected, parts = QUESTIONS[question]
    monkeypatch.chdir(files)
    status, out, err = run(capsys, *arguments)
    assert status == expected
    text = " ".join(f"{err} {out}".split())
    place = 0
    for part in parts:
        found = text.find(part, place)
        assert found >= 0, f"{part!r} is missing after {text[:place][-80:]!r} in {text}"
        place = found
    # No private words, no tracebacks, no numbers without meaning.
    for word in ("Traceback", "nan", "None", "1e+"):
        assert word not in text


def test_no_browser_is_said_in_one_line(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("EXO_PIN_BROWSER", str(tmp_path / "none"))
    status, _, err = run(capsys, "view", "four-cables", "--no-human", "--plot", str(tmp_path / "picture.png"))
    assert status == 2
    assert err.count("\n") == 1
    assert "EXO_PIN_BROWSER" in err


@pytest.mark.full
def test_stiffnesses_count_along_a_movement(files, capsys, monkeypatch):
    pandas = pytest.importorskip("pandas")
    monkeypatch.chdir(files)
    stiff = ["--shoulder-stiffness", "20000", "--guide", "900", "350", "--split", "elastic"]
    forces = []
    for options in ([], stiff):
        run(
            capsys, "reaction", "prototype", *PERSON, "--trajectory", "lift.csv", "--static", "--out", "f.csv", *options
        )
        forces.append(pandas.read_csv(files / "f.csv")["F_s_N"].to_numpy())
    rigid, elastic = forces
    held = np.isfinite(rigid) & np.isfinite(elastic)
    assert held.any()
    assert np.abs(rigid - elastic)[held].max() > 0.1
