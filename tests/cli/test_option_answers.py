"""Answers of commands whose options have odd values, as they are stored."""

import functools

import pytest
from answers import changes, each_of
from asked_commands import MAN, POSE, QUICK, WOMAN, answered_in_turn

WORN = "four-linear-actuators-worn"
#: New designs: the search ends after its first designs.
NEW = f"{WOMAN} --budget 12 --run-length 12 --step 60 --refine --no-twins"

COMMANDS = {
    "criteria": [
        f"workspace {WORN} --step 60 {MAN} --no-muscles --json {options}"
        for options in (
            "--gap 7 --obstacle chair --obstacle wall:60 --shoulder-force 120 --no-twins --least-margin 0.11",
            "--criteria forces,shoulder_force,stroke --shoulder-force 66 --least-tension 3 --stroke-rule each",
            "--least-moment 2.5 --pull-out 15 --cuff-pull 40 --above-elbow 30 --without-limb 0.4 --rate 0.7",
            "--fits 1.6,55,female --fits 1.9,100,male --clothing 6",
            "--elbow-range 10,95",
            "--offset 6 -9 4",
            "--moving-centre",
            "--cuff-slip 12",
            "--obstacle ceiling:700",
        )
    ]
    + [
        "workspace urdf/nesm.urdf --step 60 --rate 0.5 --json",
        'workspace appendix-d --step 60 --stroke-rule "not all short" --json',
        "workspace four-cables --elbow-range 9",
    ],
    "fitted": [
        "muscle step --weight-N 10 --to-bar 3.6 --mark --duration-s 0.15 --out response.csv",
        "muscle identify --response response.csv 10 --name mine --out moving.toml",
        "muscle step --model moving.toml --mass-kg 1.2 --to-bar 3 --from-bar 0.5 --lag-s 0.15 --mark --duration-s 1",
        "muscle identify examples/muscle.csv --length-mm 300 --diameter-mm 21 --all --name still --out still.toml",
        "muscle force --model still.toml --contraction-mm 10 40 --pressure-bar 1 2.5 --mark",
        "muscle loop --model still.toml --to-percent 8 --mass-kg 0.8 --length-mm 280 --duration-s 1",
        "muscle pressure --force-N 40 --contraction-mm 12 --model still.toml --length-mm 260 --mark",
    ],
    "driven": [
        f"track {options} --trajectory quick.csv --no-progress --json"
        for options in (
            "prototype --supply 5 --lost-imu 0.1,0.3 --controller pi",
            "prototype --fault stuck-shut,all,0.2",
            "four-cables --play 2 --controller pi",
            "four-cables --fault no-current,2,0.1 --side right",
            f"four-cables --lost-beyond 6 --lower-in 2 --controller model {WOMAN}",
        )
    ]
    + ["thesis --section 5.1.2 --reasons --json", "thesis --section 2 --all --out rows.csv"],
    "moving": [
        "reaction prototype --to 90,0,0 --poses 4 --require-hold",
        "reaction four-cables --to 40,20,5 --require-hold",
        "reaction prototype --flexion 30 --to 30,0,0 --poses 2 --split minimal --side-force-limit actuator",
        f"reaction {WORN} {POSE} {MAN} --muscles --strength 60 --table --offset 5 -3 8",
        f"reaction {WORN} {POSE} {WOMAN} --strength 0 --json",
        "reaction four-cables --trajectory quick.csv --sensor-noise 2",
        f"person {WORN} {MAN} --trajectory quick.csv --static --share 60 --json",
        f"person {WORN} {WOMAN} --map --step 60 --least effort --out map.csv",
        f"person four-linear-actuators-worn {MAN} {POSE} --moving-centre --side-force-limit 25 --json",
        "tasks four-cables --movement swing=quick.csv --step 30 --least-moment 1.5 --json",
        "tasks four-cables --movement swing=quick.csv --no-ranges --json",
        "mobility urdf/nesm.urdf --flexion 35",
        "tasks four-cables --day --no-ranges",
        "forces urdf/prototype.urdf --external arm=3,0,-20,1,0,0.5 --external arm=0,4,0 "
        "--actuated limb_1_slide,limb_2_slide,limb_3_slide --joint limb_1_base --joint limb_2_base",
    ],
    "viewed": [
        "view prototype --no-human --scale 250 --flexion 35 --plot a.html",
        f"view four-cables --side right {POSE} --plot b.html",
        f"view {WORN} --no-human --to 60,20,5 --seconds 0.3 --plot c.html",
        f"view prototype --limbs muscles {POSE} --plot d.html",
        "view urdf/dummy-shoulder.urdf --set shoulder_x=20deg --plot e.html",
        f"view {WORN} {WOMAN} --mannequin --plot f.html",
        "view urdf/dummy-shoulder.urdf --scale 9 --plot g.html",
        "view prototype --set shoulder_x=2deg --plot h.html",
        "track four-cables --trajectory quick.csv --no-progress --plot i.html",
        f"view urdf/nesm.urdf {POSE} --plot k.html",
    ],
    "starts": [
        f"optimise {options} {NEW}"
        for options in (
            "--limbs 3 --family 'pneumatic muscle' --force-law best --supply 3.5 --side right --out found.toml",
            "--limbs 4 --family linear --pull 300 --push 150 --travel 210 --device geometry --base-radius 130:240",
            "--family cable --arm-radius 60:120 --drop 90:250 --device prototype",
        )
    ]
    + [
        f"optimise four-cables --pull 250 --travel 300 {NEW} --objective index --objective peak_shoulder_force "
        "--out front.toml --json",
        f"optimise {WORN} --vary cuff_height_mm=60:110 --moving-centre --fixed-centre {NEW}",
        "optimise four-cables --limbs 4 --supply 3",
        "optimise --limbs 4",
    ],
}
ASKED = {name: functools.partial(answered_in_turn, lines, quick_csv=QUICK) for name, lines in COMMANDS.items()}


@each_of(ASKED, ASKED)
def test_an_answer_is_as_stored(name):
    if name == "starts":
        pytest.importorskip("optuna", reason="needs the extra optimise")
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    assert not changes(__file__, name, ASKED[name])
