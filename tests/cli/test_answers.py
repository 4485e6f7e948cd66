"""Answers of commands as they are stored: what they print and write, the errors of wrong ones, and their codes."""

import functools

import pytest
from answers import changes, each_of
from asked_commands import MAN, POSE, QUICK, WOMAN, answered_in_turn
from urdf_knee import GOOD

TABLE = "flexion_deg,abduction_deg,internal_rotation_deg\n20,30,5\n50,60,-10\n100,20,30\n"
SEARCH = "four-cables --refine --vary cuff_height_mm=150:250 --budget 12 --run-length 12 --step 60"
BENT = (
    f"time_s,{TABLE.splitlines()[0]},elbow_flexion_deg\n"
    + """0,20,-80,5,10
0.1,21,-83,5,30
0.2,22,-86,5,20
0.3,23,-89,5,20
0.4,24,-89.5,5,40
0.5,2,-2,5,50
"""
)
QUESTIONS = """{"ask": "reaction", "design": "four-cables", "flexion": 60}
{"ask": "nothing"}

no json
{"ask": "kinematics", "design": "prototype", "flexion": 20}
"""

#: Commands by what they are about; those of a person need what that extra brings.
COMMANDS = {
    "kinematics": [
        f"kinematics prototype {POSE} --out lengths.json",
        "kinematics prototype --lengths 262.96,330.50,384.21 --json", f"kinematics urdf/nesm.urdf {POSE}",
        "kinematics urdf/spherical-3rrr.urdf --flexion 20",
        "kinematics urdf/dummy-shoulder.urdf --set shoulder_x=20deg", "kinematics prototype --lengths 3.2,3.1,2",
        "kinematics urdf/dummy-shoulder.urdf --set shoulder_y=20deg --set shoulder_x=-8deg --set shoulder_z=0.3rad",
        "kinematics prototype --lengths 262.96,330.50",
        "kinematics nothing",
        "kinematics prototype --flexion forty", "kinematics prototype --set shoulder_x=20deg",
        "kinematics --flexion 200", "kinematics urdf/nesm.urdf --set flexion=40deg",
        "kinematics four-cables --side up",
    ],
    "singularity": [f"singularity prototype {POSE}", "singularity prototype --abduction 90 --json",
    f"singularity four-cables {POSE} --out near.json", f"singularity urdf/serial-y-x-z.urdf {POSE}",
    "singularity prototype --abduction 90 --plot map.txt"],
    "reaction": [
        f"reaction four-cables {POSE} --compare --table",
        f"reaction prototype {POSE} --split minimal --side-force-limit 9 --out forces.csv",
        f"reaction four-cables {POSE} --to 90,0,0 --poses 3 --json",
        f"reaction four-cables {POSE} --limits 5,60 --require-hold --hand-force 0,0,-90",
        f"reaction four-cables {POSE} --to -30,110,40 --poses 2 --require-hold",
        f"reaction four-cables {POSE} --to 60,20,0 --poses 2 --require-hold",
        "reaction four-cables --trajectory examples/lift.csv --static --out path.csv",
        "reaction urdf/3rps-passive-ball.urdf --flexion 10 --posture cuff_slide_mm=4",
        f"reaction urdf/nesm.urdf {POSE} --over-postures", f"reaction prototype {POSE} --split best",
        f"reaction prototype {POSE} --limits some", "reaction four-cables --to 90,0",
        "reaction four-cables --trajectory nothing.csv",
        f"reaction four-cables {POSE} --offset 5,0", f"reaction four-cables {POSE} --person 1.75,75",
        f"reaction four-cables {POSE} --person 1.75,75,man",
        f"reaction four-cables {POSE} {MAN} --clothing 8 --explain", "reaction --poses 3",
    ],
    "judged": [
        "workspace prototype --step 45 --no-twins",
        "workspace four-cables --step 30 --json --criteria limits --least-margin 0.1",
        f"workspace four-cables --step 30 {WOMAN} --shoulder-force 90 --limb-table --out inside.csv",
        "workspace four-cables --step 45 --limb-loss --one-by-one", "workspace four-cables --step 30 --criteria beauty",
        "workspace four-cables --step 0",
        "workspace four-cables --step 30 --fits 1.5,50,female --elbow-range 0,90 --gap 5 --cuff-pull 80 --pull-out 60",
        "workspace urdf/serial-y-x-z.urdf --step 30", "tasks four-cables --step 40",
        "workspace urdf/3rps-passive-ball.urdf --step 90 --posture cuff_slide_mm=4",
        f"tasks four-cables --movement lifting=examples/lift.csv --no-ranges {WOMAN} --out tasks.csv",
        "tasks --day --step 40 --out day.csv", "tasks four-cables --movement lifting",
        "parts four-cables --step 40 --drive-mass 0.3 --with-masses heavy.toml",
        "parts four-linear-actuators-worn --step 40 --out parts.csv", "parts four-cables --step 45 --arm-speed 9",
    ],
    "compared": [
        f"compare four-cables four-linear-actuators {POSE} --to 90,30,0 --poses 3 --out both.csv",
        f"compare four-cables urdf/serial-y-x-z.urdf {WOMAN} --step 60",
        "compare four-cables prototype --step 40 --json", "compare four-cables",
        "compare four-cables nothing --step 40",
        "sweep four-cables --vary cuff_height_mm=180:220:2 --vary scale=0.9,1 --step 40 --out table.csv",
        f"sweep prototype --vary alpha_A[2]_deg=50,60 {POSE} --payload-at 0,0,-0.3",
        f"sweep four-cables --vary scale=0.9,1 --step 60 --payload-at 0,0,-0.4 {WOMAN}",
        "sweep four-cables --vary beauty=1,2 --step 40", "sweep four-cables --step 40",
        "sweep four-cables --vary scale --step 40", "sweep four-cables --vary scale=0.9:1:1 --step 40 --json",
        f"uncertainty four-cables {POSE}",
        f"uncertainty prototype {POSE} --uncertain offset_mm=20 --uncertain cuff_height_mm=10 --out which.csv",
        f"uncertainty four-cables {POSE} --uncertain beauty=1", f"uncertainty four-cables {POSE} {MAN} --all 4 --json",
    ],
    "designs": [
        "presets four-linear-actuators", "presets three-linear-actuators --out mine.toml",
        "presets nothing", "check examples/device.toml", "check urdf/dummy-shoulder.urdf",
        "check prototype --out checked.json", "check urdf/nesm.urdf --leave-out nothing",
        "mobility prototype --abduction 90", f"mobility urdf/spherical-3rrr.urdf {POSE}",
        "mobility urdf/dummy-shoulder.urdf --set shoulder_x=20deg", "mobility four-cables",
        "mobility urdf/appendix-d-wrist.urdf --abduction 40",
        "forces prototype --flexion 45 --out joints.json",
        "forces urdf/prototype.urdf --external arm=0,0,-20 --joint limb_1_base",
        f"forces urdf/serial-y-x-z.urdf {POSE} {WOMAN} --json", "forces urdf/prototype.urdf --external hand=0,0,-20",
        "forces prototype --actuated nothing",
        "export four-cables --out cables.urdf", f"export examples/device.toml {WOMAN} --out device.sdf",
        "export four-cables --out cables.step", "export four-cables --out", "schema", "schema singular_pose",
        "schema nothing", "thesis --section 5.1.2", "thesis --section 9.9", "thesis --reasons",
        "calibrate three-linear-actuators examples/measured.csv --out calibrated.toml",
        "calibrate three-linear-actuators examples/measured.csv --unknowns beauty",
        "calibrate prototype examples/lift.csv", "batch questions.jsonl", "batch nothing.jsonl", "beauty",
        "reaction --beauty 3", "--version-of-nothing", "presets --help",
    ],
    "muscles": [
        "muscle force --contraction-mm 20 --pressure-bar 2 4",
        "muscle force --contraction-mm 0 30 --pressure-bar 1 --length-mm 250 --mark --out pulls.csv",
        "muscle force --contraction-mm 20 --pressure-bar 9",
        "muscle force --contraction-mm 20 --pressure-bar 2 --model nothing",
        "muscle pressure --force-N 30 --contraction-mm 20", "muscle pressure --force-N 9000 --contraction-mm 20",
        "muscle pressure --force-N 30 50 --contraction-mm 20 10 --mark --out bars.csv",
        "muscle identify examples/muscle.csv --length-mm 300 --static tang --out mine.toml",
        "muscle identify nothing.csv --length-mm 300",
        "muscle step --weight-N 10 --to-bar 3.6 --mark --out response.csv",
        "muscle step --mass-kg 1 --to-bar 3 --from-bar 1 --lag-s 0.2 --duration-s 1",
        "muscle step --to-bar 3", "muscle loop --to-percent 15 --weight-N 12.74 --duration-s 2",
        "muscle loop --to-percent 9 --mass-kg 1 --length-mm 250 --out l.csv",
        "muscle loop --to-percent 99 --mass-kg 1", "muscle",
        "muscle force --contraction-mm 20 --pressure-bar 2 --model none.toml",
        "muscle step --mass-kg 1 --to-bar 3 --model none.toml",
        "muscle loop --to-percent 9 --mass-kg 1 --model none.toml",
    ],
    "moved": [
        "record examples/lift.csv", "record examples/lift.csv --angles isb --out isb.csv",
        "record examples/lift.csv --against examples/lift.csv --json", "record nothing.csv",
        "record examples/measured.csv", "record table.csv", "track --list",
        "record bent.csv --reading as-named --angles isb --out bent_isb.csv",
        "track four-cables --trajectory quick.csv --no-progress --out run.csv",
        "track prototype --trajectory quick.csv --fault burst,3,0.2 --no-progress",
        "track four-cables --trajectory quick.csv --fault torn,1,0.1 --lost-beyond 10 --lower-in 3 --json",
        "track --experiment nothing", "track prototype --trajectory abduction --fault melt,1,1",
        "track four-cables --trajectory quick.csv --controller nothing", "track prototype --fault burst,4,1",
        "track four-cables --lost-imu 3,2", "view four-cables --plot view.txt",
    ],
    "options": [
        "kinematics prototype --lengths 0.262,0.33,0.38",
        "track prototype --supply 3 --trajectory quick.csv",
        "track four-cables --play 0.5 --trajectory quick.csv",
        "track four-cables --supply 3 --trajectory quick.csv", "track prototype --play 1 --trajectory quick.csv",
        "track prototype --lost-beyond 10 --controller pi --trajectory quick.csv", "track quick.csv", "track abduction",
        "track --trajectory four-cables",
        f"reaction four-cables {POSE} --to 90,0,0 --poses 1", f"reaction four-cables {POSE} --offset 0.005 0 0",
        f"reaction prototype {POSE} --hand-force 0,0,-9", f"reaction prototype {POSE} --payload 1",
        f"reaction four-cables {POSE} --payload 1.5 --elbow-flexion 40", "reaction four-cables --poses 3 --flexion 90",
        f"reaction four-cables {POSE} --person 1.75,75,mail", "reaction four-cables --trajectory quick.csv --flexion 9",
        "reaction four-cables --trajectory quick.csv --out path.csv --start 0.1 --duration 0.3",
        "record quick.csv --sensor trunk", "record quick.csv --start -1", "record quick.csv --duration 1e9",
        "workspace prototype --pull-out 50 --step 45", "workspace prototype --moving-centre --step 45",
        "compare four-cables prototype --trajectory quick.csv",
        "sweep four-cables --vary scale=0.9,1 --to 90,0,0 --poses 3",
        "calibrate examples/measured.csv", "calibrate three-linear-actuators examples/measured.csv --length-noise 0",
        "calibrate three-linear-actuators examples/measured.csv --tolerance base_points=2",
        "muscle identify examples/muscle.csv",
        "export four-cables --on-person myoarm --part arm --out worn.xml",
        "parts urdf/serial-y-x-z.urdf --step 45 --with-masses heavy.toml", "schema examples/questions.jsonl",
        "reaction four-cables --out forces.txt", "--help", "", "--version 3", "check four-cables --out checked.json",
        "reaction four-cables --split=spherical --flexion=-20 --abduction=10", "thesis --all --section 4",
        "app nothing", "report nothing --person 1.6,55,female", "serve --port 70000", "serve --seconds 0",
        "mobility urdf/nesm.urdf --leave-out dampers", "kinematics urdf/spring-support.urdf --flexion 40",
    ],
    "drawn": [
        f"{line} --plot {k}.png" for k, line in enumerate([
            "workspace four-cables --step 45 --draw ball", "workspace four-cables --step 45",
            "workspace four-cables --step 45 --criteria forces,stroke --json",
            f"reaction four-cables {POSE} --to 90,0,0 --poses 4", f"reaction prototype {POSE}",
            "reaction four-cables --trajectory quick.csv", f"singularity prototype {POSE}",
            "muscle force --contraction-mm 20 --pressure-bar 2", "muscle step --weight-N 10 --to-bar 3.6 --mark",
            "muscle loop --to-percent 9 --mass-kg 1 --duration-s 1", "record quick.csv",
            "track four-cables --trajectory quick.csv --no-progress",
            "tasks four-cables --step 45 --movement swing=quick.csv",
            "tasks --day --step 45", f"uncertainty four-cables {POSE}",
            "sweep four-cables --vary scale=0.9,1 --step 45", f"view four-cables {POSE}",
            "compare four-cables prototype --step 45",
            f"optimise {SEARCH} --json", f"optimise {SEARCH}",
        ], start=1)
    ],
    "mistaken": [
        "reaction four-cables --compare --offset 0.01 0 0", "reaction prototype --flexion 1.0471975511965976",
        "reaction four-cables --person 1.75,75,male --no-muscles --payload 20", "reaction prototype --abduction 6.2",
        "reaction prototype --abduction 90", "reaction prototype --side right --abduction -80",
        f"reaction prototype {POSE} --compare elastic",
        f"reaction prototype {POSE} --compare spherical --side-force-limit 5",
        "reaction four-cables --flexion 60 --person 1.75,75,male --elbow-flexion 140 --explain",
        "reaction prototype --to 0,90,0 --poses 2 --require-hold", "reaction --to 90,0,0 --table",
        "reaction urdf/serial-y-x-z.urdf --muscles", "reaction --muscles --person 1.75,75,male --trajectory quick.csv",
        "reaction --person 75,1.75,m", "reaction --person 1.75,female,60", "workspace --fits 75,1.75,male",
        "reaction prototype --person 175,75,male", "reaction prototype --side-force-limit much",
        "reaction --plot picture.xyz", "reaction --out forces.png", "reacton", "muscle forc", "reaction --flexon 60",
        "help presets", "check prototype --help", "sweep --vary scale=1 --vary scale=2",
        "sweep prototype --vary r_A_mm=100:130:nan", "mobility urdf/dummy-shoulder.urdf --set shoulder_x=20mm",
        "mobility urdf/dummy-shoulder.urdf --set shoulder_x=much",
        "mobility urdf/serial-y-x-z.urdf --set flexion=400deg",
        "mobility urdf/dummy-shoulder.urdf --flexion 20", "forces urdf/prototype.urdf --external arm=1,2",
        "export prototype --locked elbow", "export prototype --on-person myoarm --payload 1 --part wrist",
        "export four-cables --on-person myoarm --bones-only --out worn.xml",
        "export four-cables --on-person nobody.xml --out worn.xml", "export prototype --out here.stl",
        "kinematics prototype --lengths 10,900,10", "kinematics urdf/3rps-passive-ball.urdf --flexion 10",
        "singularity scenario-one",
        "track urdf/serial-y-x-z.urdf --payload 2", "track four-cables --rate 3", "tasks four-cables --rate 50",
        "track --experiment held-abduction --trajectory flexion", "track prototype --experiment flexion",
        "check prototype --leave-out tendons",
        "reaction --no-muscles --strength 0", "forces urdf/spring-support.urdf --joint root_joint",
        "person --range --out x.csv", "person --range --map", "person --bare --share 50",
        "person --bare --side-force-limit 30", "person --share 50 --least effort", "person --elbow-flexion 150",
        "muscle identify", "muscle identify --response quick.csv heavy", "muscle identify --response quick.csv -5",
        "muscle identify --length-mm 300 table.csv", "muscle step --mass-kg 50 --to-bar 3 --mark --duration-s 0.1",
        "muscle step --mass-kg 2 --to-bar 2 --duration-s 1e9", "tasks four-cables --plot none.png",
        "optimise --limbs 4", "optimise prototype --vary r_A_mm=50", "optimise prototype --moving-centre",
        "optimise four-cables --fixed-centre", "optimise four-cables --base-radius 120", "optimise appendix-d --pull 9",
        "track scenario-one --trajectory quick.csv", "track prototype --trajectory quick.csv --fault burst,nan,2",
        "track --experiment abduction --fault burst,3,99", "track --experiment abduction --supply 400000",
        "view prototype --to 1,2", "view prototype --to 1,2,3 --seconds 1e9 --plot x.html", "view --port 70000",
        "view prototype --no-human --plot x.png --size big", "view prototype --scale 0", "view --seconds 2",
        "view --plot x.html --open", "view --plot x.html --size 9x9", "view --to 9,0,0 --plot x.png",
        "workspace prototype --payload 1 --step 45", "workspace four-cables --json --limb-table",
        "workspace appendix-d --criteria shoulder_range --step 45", "workspace prototype --fits tall",
        "workspace four-linear-actuators-worn --step 45 --limb-loss",
        "schema old.json", "schema new.json", "schema no.json", "schema misspelt.json", "schema list.json",
    ],
    "seldom": [
        "kinematics prototype --lengths -0.2,-0.3,-0.3", "reaction urdf/six-cables.urdf --over-postures --json",
        "track --experiment abduction --payload 1", "forces left.urdf --set knee=20deg", "mobility left.urdf",
        f"sweep four-cables --vary cuff_height_mm=150,170 --flexion 50 {MAN} --payload-at 0,0,-0.4",
        f"sweep four-cables --vary cuff_height_mm=150,170 --flexion 50 {MAN} --muscles",
        "reaction prototype --out old.csv", "reaction prototype --out old.json",
    ],
    "persons": [
        "person prototype --flexion 40 --share 0.5 --least effort",
        f"person four-cables {POSE} --range --out range.csv",
        f"person --bare --map --step 45 {WOMAN}", "person urdf/spring-support.urdf --flexion 60 --share 50",
        f"person four-cables {POSE}",
        f"person four-cables {POSE} {MAN} --share 0.5 --strength 0.8 --out contact.csv",
        f"person --bare {POSE} {WOMAN}", f"person prototype {POSE} --least effort",
        f"person four-cables {POSE} --least contact --json --limits 0,90",
        "person four-cables --trajectory examples/lift.csv --rate 5", f"person four-cables {POSE} --share 2",
        f"person four-cables {POSE} --strength -1", "person --bare --flexion 40 --abduction -140",
        f"reaction four-cables {POSE} {MAN} --muscles --strength 0.9",
        f"reaction urdf/spring-support.urdf {POSE} {WOMAN} --muscles",
    ],
}  # fmt: skip

DOCUMENTS = {
    "old_json": '{"schema": "exo_pin.reaction/0"}', "new_json": '{"schema": "exo_pin.reaction/2"}', "no_json": "{",
    "misspelt_json": '{"schema": "exo_pin.reacton/1"}', "list_json": "[]",
}  # fmt: skip
LEFT = GOOD.replace("</joint>", '<safety_controller k_velocity="1"/></joint>')
FILES = {
    "left_urdf": LEFT,
    "table_csv": TABLE,
    "questions_jsonl": QUESTIONS,
    "quick_csv": QUICK,
    "bent_csv": BENT,
} | DOCUMENTS

ASKED = {name: functools.partial(answered_in_turn, lines, **FILES) for name, lines in COMMANDS.items()}

#: Those that take longer than 0.15 s.
LONGER = set(ASKED) - {"singularity"}


@each_of(ASKED, LONGER)
def test_an_answer_is_as_stored(name):
    if name == "drawn":
        pytest.importorskip("optuna", reason="needs the extra optimise")
    elif name not in {"kinematics", "singularity", "designs", "muscles"}:
        pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    assert not changes(__file__, name, ASKED[name])
