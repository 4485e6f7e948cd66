"""Command line of the muscles."""

import csv
import re

import numpy as np
import pytest
from places import DOCS, REPOSITORY

from exo_pin import FileFormatError, InvalidInput
from exo_pin.cli.command import answer
from exo_pin.cli.muscle_commands import _DYNAMIC, _STATIC
from exo_pin.control import muscle_loop
from exo_pin.muscle import (
    OutsideValidity,
    PolynomialModel,
    PressureStep,
    dynamic_model,
    identify_static,
    load_dynamic,
    load_parameters,
    muscle_model,
    read_measurements,
    simulate,
    steady_states,
)


@pytest.fixture
def run(capsys):
    def call(*words):
        assert answer(f"muscle {words[0]}", [str(word) for word in words[1:]]) == 0
        return capsys.readouterr().out

    return call


def write_states(path):
    states = steady_states()
    with path.open("w") as stream:
        stream.write("# Tables 3-1 and 3-2\nforce_N,contraction_mm,pressure_bar\n")
        for x, p, f in zip(states.contraction, states.pressure, states.force, strict=True):
            stream.write(f"{f:.2f},{x * 1e3:.3f},{p / 1e5:.3f}\n")


def test_force(run):
    lines = run("force", "--contraction-mm", 20, 50, "--pressure-bar", 3, "--model", "tang-optimised").splitlines()
    assert lines[0] == "tang-optimised, 300 mm"
    model = muscle_model("tang-optimised")
    for line, x in zip(lines[2:], (0.020, 0.050), strict=True):
        values = [float(word) for word in line.split()]
        expected = [
            x * 1e3,
            3.0,
            model.force(x, 3e5),
            model.stiffness(x, 3e5) / 1e3,
            model.pressure_gain(x, 3e5) * 1e5,
        ]
        np.testing.assert_allclose(values, expected, atol=0.0051)


def test_outside_is_refused_or_marked(run):
    with pytest.raises(OutsideValidity):
        run("force", "--contraction-mm", 5, "--pressure-bar", 3)
    out = run("force", "--contraction-mm", 5, 50, "--pressure-bar", 3, "--mark")
    assert out.splitlines()[2].count("*") == 3
    assert "*" not in out.splitlines()[3]
    assert out.splitlines()[-1].startswith("* outside")


def test_pressure_and_scaling(run):
    out = run("pressure", "--force-N", 13, "--contraction-mm", 37.5, "--length-mm", 150, "--model", "tang-optimised")
    assert out.splitlines()[0] == "tang-optimised, 150 mm"
    assert out.splitlines()[2].split() == ["13.00", "37.50", "4.001"]
    out = run("pressure", "--force-N", 300, "--contraction-mm", 50, "--mark")
    assert "none" in out


def test_identify_writes_a_set_that_force_reads(run, tmp_path):
    data, output = tmp_path / "data.csv", tmp_path / "set.toml"
    write_states(data)
    out = run("identify", data, "--length-mm", 300, "--out", output, "--name", "mine")
    first, second = out.splitlines()[:2]
    assert first.startswith("Taken as known: 0.1 bar of the gauge's zero: ")
    assert second.startswith("27 of 66 measurements")
    assert "Caution: The data cannot distinguish K_1, K_2, C_1, S_1, S_2, S_3: compare forces." in out
    model = load_parameters(output)
    assert model.name == "mine"
    reference = muscle_model("fitted-second-order")
    x, p = np.array([0.02, 0.06]), np.array([2.5e5, 3.5e5])
    # The CSV holds what the tables print, so nothing is lost on the way.
    np.testing.assert_allclose(model.force(x, p), reference.force(x, p), atol=1e-6)
    assert run("force", "--model", output, "--contraction-mm", 50, "--pressure-bar", 3.5).startswith("mine, 300 mm")
    assert run("identify", data, "--length-mm", 300, "--all").splitlines()[1].startswith("66 of 66")


def test_the_tutorial_shows_the_numbers_of_the_command(run):
    page = (DOCS / "tutorials" / "muscles.md").read_text()
    command = re.search(r"exo-pin muscle (identify .*) --out law.toml", page)[1].split()
    out = run(*(str(REPOSITORY / word) if word.endswith(".csv") else word for word in command))
    assert out.splitlines()[0] in page
    assert out.splitlines()[1] in page
    assert f"rms {float(re.search('rms ([0-9.]+)', out)[1]):.3f} N" in page
    shown = re.search(r"off by ([0-9.]+) N \(rms\), ([0-9.]+) N where", page.split("```text")[1]).groups()
    assert [f"{float(value):.2f}" for value in re.findall(r"([0-9.]+) N", out.splitlines()[1])] == list(shown)


def test_the_page_on_muscle_data_shows_the_numbers_of_command_and_python(run, tmp_path):
    page = (DOCS / "howto" / "muscle_data.md").read_text()
    command = re.search(r"exo-pin muscle (identify examples/.*)", page)[1].split()
    out = run(*(str(REPOSITORY / word) if word.endswith(".csv") else word for word in command))
    data = read_measurements(REPOSITORY / "examples" / "muscle.csv", nominal_length=0.3)
    fit = identify_static(data.contraction, data.pressure, data.force, 0.3, diameter=0.006)
    gauge, ruler, _ = (each.effects["force_percent"] for each in fit.known)
    assert f"zero changes\nthe force by {gauge:.2g} % of the middle one" in page
    assert f"the contraction's zero by {ruler:.2g} %" in page
    assert f"{gauge:.2g} % of the force; 1 mm of the contraction's zero: {ruler:.2g} % of the force" in out
    assert f"rms {fit.rms:.3g} N, leave-one-out {fit.leave_one_out_rms:.3g} N" in out
    (tmp_path / "law.toml").write_text(re.search(r"```toml\n(.*?)```", page, re.DOTALL)[1])
    law = load_parameters(tmp_path / "law.toml")
    made = PolynomialModel.tondu_lopez(0.010, np.radians(25.0), 0.25, k=1.2, name="braid", validity=law.validity)
    assert law.force(0.03, 3e5) == pytest.approx(made.force(0.03, 3e5))
    shown = run("force", "--contraction-mm", 30, "--pressure-bar", 3, "--model", tmp_path / "law.toml")
    assert f"{law.force(0.03, 3e5):.2f}" in shown


def test_step_and_identify_have_one_default_law():
    assert dynamic_model(_DYNAMIC).static.name == _STATIC


@pytest.mark.full
def test_identify_responses(run, tmp_path):
    model = dynamic_model("tang-3-31")
    words = []
    times = np.linspace(0, 1.0, 26)
    for weight, initial, final in ((12.74, 2.0e5, 3.6e5), (22.74, 2.6e5, 4.0e5)):
        pressure = PressureStep(initial, final, 0.0, 0.1)
        r = simulate(model, weight / 9.81, pressure, times, outside="mark")
        path = tmp_path / f"{weight}.csv"
        with path.open("w", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(("time_s", "contraction_mm", "pressure_bar"))
            writer.writerows(zip(times, r.contraction * 1e3, r.pressure / 1e5, strict=True))
        words += ["--response", path, weight]
    output = tmp_path / "dynamic.toml"
    out = run("identify", *words, "--static", "tang-3-25", "--out", output)
    first, second = out.splitlines()[:2]
    assert first.startswith("Taken as known: 1 % of the force law: ")
    assert second.startswith("52 samples")
    found = load_dynamic(output)
    x = np.array([0.045, 0.06, 0.07])
    expected = model.friction.printed(x, 3.6e5, 1.3)
    # Pressure between samples of 40 ms is interpolated: some per cent.
    np.testing.assert_allclose(found.friction.printed(x, 3.6e5, 1.3), expected, rtol=0.15)
    assert run("step", "--model", output, "--weight-N", 22.74, "--from-bar", 2.6, "--to-bar", 3.6).startswith("ident")


def test_step(run, tmp_path):
    path = tmp_path / "step.csv"
    out = run("step", "--weight-N", 22.74, "--from-bar", 2.6, "--to-bar", 3.6, "--out", path, "--duration-s", 2)
    response = simulate(
        dynamic_model("tang-3-31"), 22.74 / 9.81, PressureStep(2.6e5, 3.6e5, 0.0, 0.1), np.linspace(0, 2, 2001)
    )
    assert f"to {response.steady_state * 1e3:.2f} mm" in out
    assert f"settling time  {response.settling_time():.3f} s" in out
    assert "at rest        yes" in out
    with path.open() as stream:
        written = list(csv.DictReader(stream))
    assert len(written) == 2001
    assert abs(float(written[-1]["contraction_mm"]) - response.steady_state * 1e3) < 1e-5
    with pytest.raises(OutsideValidity, match="strain"):
        run("step", "--weight-N", 22.74, "--to-bar", 3.6)
    short = run("step", "--mass-kg", 3, "--to-bar", 3, "--mark", "--duration-s", 0.5)
    assert "settling time  longer than the response" in short
    heavy = run("step", "--mass-kg", 50, "--to-bar", 3, "--mark", "--duration-s", 0.1, "--out", path)
    assert "no step        the mass ends where it began" in heavy
    assert "Caution: The motion is inside the range of the model for 0.0 % of the time" in heavy
    assert len(path.read_text().splitlines()) == 102
    assert "inside the range of the model for 9" in run("step", "--mass-kg", 2.3, "--to-bar", 3.6, "--mark")


def test_pictures(run, tmp_path):
    map_path, step_path = tmp_path / "map.png", tmp_path / "step.png"
    run("force", "--contraction-mm", 50, "--pressure-bar", 3, "--plot", map_path)
    run("step", "--weight-N", 22.74, "--from-bar", 2.6, "--to-bar", 3.6, "--duration-s", 1.5, "--plot", step_path)
    loop_path = tmp_path / "loop.png"
    out = run("loop", "--to-percent", 15, "--weight-N", 12.74, "--plot", loop_path)
    page = (DOCS / "howto" / "muscle_data.md").read_text()
    error, overshoot = (re.search(rf"{word} +(-?[0-9.]+) %", out)[1] for word in ("steady error", "overshoot"))
    assert f"the steady error is {error.lstrip('-')} % (it sticks beyond), the overshoot {overshoot} %" in page
    loop = muscle_loop(muscle_model("best", 0.25), 12.74 / 9.81, 0.15)
    assert (f"{100 * loop.steady_error:.2g}", f"{100 * loop.overshoot:.2g}") == (error, overshoot)
    for path in (map_path, step_path, loop_path):
        assert path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("contraction_mm,pressure_bar\n1,2\n", "one column of force, force_N"),
        (
            "contraction_mm,pressure_bar,force_N\n1,2,3\n\n# c\n1,2,x\n",
            "line 5: expected a finite number in column force_N",
        ),
        ("contraction_mm,pressure_bar,force_N\n1,2\n", "line 2: expected 3 cells"),
        ("contraction_mm,pressure_bar,force_N\n1,2,nan\n", "line 2: expected a finite number"),
        ("contraction_mm,pressure_bar,force_N\n", "at least one line"),
        ("", "is empty"),
    ],
)
def test_bad_csv_is_named(run, tmp_path, text, message):
    path = tmp_path / "data.csv"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=message):
        run("identify", path, "--length-mm", 300)


def test_bad_calls(run, tmp_path):
    with pytest.raises(InvalidInput, match="both or neither"):
        run("identify", "--length-mm", 300)
    write_states(tmp_path / "data.csv")
    with pytest.raises(InvalidInput, match="--length-mm"):
        run("identify", tmp_path / "data.csv")
    with pytest.raises(InvalidInput, match="number of N"):
        run("identify", "--response", tmp_path / "data.csv", "heavy")
    again = tmp_path / "again.csv"
    again.write_text("time_s,contraction_mm,pressure_bar\n0,0,1\n0,0,1\n")
    with pytest.raises(FileFormatError, match=r"again.csv: .*rise from sample to sample"):
        run("identify", "--response", again, 20)
    with pytest.raises(InvalidInput, match=r"weight behind .*again.csv to be above zero, got -5"):
        run("identify", "--response", again, -5)
    with pytest.raises(FileFormatError, match="cannot be read"):
        run("identify", tmp_path / "none.csv", "--length-mm", 300)
    with pytest.raises(InvalidInput, match="one of --mass-kg and --weight-N"):
        run("step", "--to-bar", 3)
