"""``exo-pin contact``."""

import json

import pytest

pytest.importorskip("myo_sim", reason="needs the extra person: pip install 'exo_pin[person]'")

from exo_pin.cli import main


def run(capsys, *arguments):
    status = main(["contact", *(str(argument) for argument in arguments)])
    return status, *capsys.readouterr()


def test_contact_with_and_without_the_device(capsys):
    status, out, _ = run(capsys, "prototype", "--abduction", 60)
    assert status == 0
    assert "67 % less than without the device" in out
    assert "limb 3 force, N" in out
    _, bare, _ = run(capsys, "prototype", "--abduction", 60, "--bare")
    assert "no device" in bare
    assert "The joint carries 489 N" in bare


def test_contact_as_json(capsys):
    _, out, _ = run(capsys, "--abduction", 60, "--share", 50, "--json", "--cubes", "--volumes", "--any-direction")
    data = json.loads(out)
    assert data["status"] == "ok"
    assert data["assumptions"]["criterion"].startswith("least sum of cubed activations, volume weights")
    assert data["without_device"]["magnitude"] > data["magnitude"]


def test_contact_with_chosen_limb_forces(capsys):
    _, out, _ = run(capsys, "--abduction", 45, "--least", "effort", "--tension", "0,400", "--moving-centre")
    assert "chosen together with the activations" in out


def test_contact_over_the_assumptions(capsys):
    _, out, _ = run(capsys, "--abduction", 60, "--bare", "--range")
    assert "no condition on the socket" in out
    assert "centre +5 mm up" in out


def test_contact_force_is_plotted(capsys, tmp_path):
    status, out, _ = run(capsys, "--flexion", 30, "--plot", tmp_path / "contact.png")
    assert status == 0
    assert out.strip().endswith("contact.png")
    assert (tmp_path / "contact.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--share", 50, "--least", "effort"), "one of the two"),
        (("--pull",), "--least"),
        (("--bare", "--share", 50), "without a device"),
        (("--range", "--json"), "leave one out"),
        (("--abduction", 200), "plane of elevation"),
        (("--person", "tall"), "HEIGHT,MASS,SEX"),
        (("--elbow-flexion", 150), "130"),
    ],
)
def test_wrong_options_give_one_line(capsys, arguments, message):
    status, out, err = run(capsys, *arguments)
    assert status == 2
    assert message in err
    assert out == ""
