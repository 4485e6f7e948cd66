"""Parameter files: what is written comes back, and what is wrong is named."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomli_w

from exo_pin import FileFormatError, InvalidInput
from exo_pin.core.errors import FileNotWritten
from exo_pin.core.files.toml_tables import write_toml
from exo_pin.muscle import (
    ConstantFriction,
    FrictionLaw,
    dynamic_model,
    dynamic_models,
    load_dynamic,
    load_parameters,
    muscle_model,
    muscle_models,
    save_dynamic,
    save_parameters,
)


@pytest.mark.parametrize("name", muscle_models())
def test_static_sets_come_back(name, tmp_path):
    model = muscle_model(name)
    path = tmp_path / "set.toml"
    save_parameters(replace(model, notes=("a note",)), path, identification={"rms_N": 0.4})
    back = load_parameters(path)
    assert type(back) is type(model)
    assert back.name == model.name
    assert back.source == model.source
    assert back.notes == ("a note",)
    np.testing.assert_allclose(back.validity.pressure, model.validity.pressure, rtol=1e-15)
    x, p = np.array([0.02, 0.05]), np.array([3e5, 3.7e5])
    np.testing.assert_allclose(back.unchecked_force(x, p), model.unchecked_force(x, p), rtol=1e-13)
    assert tomllib.loads(path.read_text())["notes"] == ["a note"]


@pytest.mark.parametrize("name", dynamic_models())
def test_dynamic_sets_come_back(name, tmp_path):
    model = dynamic_model(name)
    path = tmp_path / "set.toml"
    save_dynamic(model, path)
    back = load_dynamic(path)
    state = (0.05, 0.3, 3.6e5, 1.3)
    np.testing.assert_allclose(back.force(*state), model.force(*state), rtol=1e-13)
    np.testing.assert_allclose(back.force(0.05, 0.0, 3.6e5, 1.3), model.force(0.05, 0.0, 3.6e5, 1.3), rtol=1e-13)


def test_a_friction_without_a_format_is_refused(tmp_path):
    class Own(ConstantFriction):
        pass

    class Other(FrictionLaw):
        bound = factors = margin = printed = lambda self, *_: 0.0

    model = dynamic_model("tang-3-31")
    save_dynamic(replace(model, friction=Own(3.0)), tmp_path / "own.toml")
    assert load_dynamic(tmp_path / "own.toml").friction == ConstantFriction(3.0)
    with pytest.raises(InvalidInput, match="friction law with a file format, got Other"):
        save_dynamic(replace(model, friction=Other()), tmp_path / "other.toml")


def changed(tmp_path, change, dynamic=False):
    path = tmp_path / "set.toml"
    if dynamic:
        save_dynamic(dynamic_model("tang-3-31"), path)
    else:
        save_parameters(muscle_model("tang-optimised"), path)
    content = tomllib.loads(path.read_text())
    change(content)
    path.write_text(tomli_w.dumps(content))
    return path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.pop("form"), "form: missing"),
        (lambda c: c.update(form="spline"), r"form: expected one of polynomial, force-table, .*; got 'spline'"),
        (lambda c: c.update(color="red"), "color: unknown key; this table may have"),
        (lambda c: c.update(reference_length_m="0.3"), "reference_length_m to be real numbers"),
        (lambda c: c.update(reference_length_m=-0.3), "reference_length to be above zero"),
        (lambda c: c["validity"].pop("strain"), r"validity\.strain: missing"),
        (lambda c: c["validity"].update(strain=[0.3, 0.1]), "lower below upper"),
        (lambda c: c["validity"].update(pressure_bar=[1.0]), r"validity\.pressure_bar: .* shape \(2,\)"),
        (lambda c: c["validity"].pop("capability_intercept_N"), r"validity\.capability_intercept_N: missing"),
        (lambda c: c["validity"].update(pressure_Pa=[1, 2]), r"validity\.pressure_Pa: unknown key"),
        (lambda c: c["coefficients"][0].update(unit="N m^-2 Pa^-1"), r"expected the unit 'N m\^-2 bar\^-1'"),
        (lambda c: c["coefficients"][0].update(value=float("nan")), "finite"),
        (lambda c: c["coefficients"].append(c["coefficients"][0]), "two coefficients"),
        (lambda c: c["coefficients"][0].update(contraction_power=-1), "powers of zero or more"),
        (lambda c: c.update(coefficients=[]), "at least one coefficient"),
    ],
)
def test_wrong_static_files_are_named(tmp_path, change, message):
    path = changed(tmp_path, change)
    with pytest.raises(FileFormatError, match=message) as caught:
        load_parameters(path)
    assert caught.value.path == str(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c["friction"].update(form="viscous"), r"friction\.form: expected one of constant, load-dependent"),
        (lambda c: c["friction"].pop("load_bar_per_kg"), r"friction\.load_bar_per_kg: missing"),
        (lambda c: c["friction"].update(mu=1.0), r"friction\.mu: unknown key"),
        (lambda c: c["damping"].update(D_2_N_s_per_m_bar=True), r"damping\.D_2_N.*: expected numbers, got True"),
        (lambda c: c.update(static="tang"), r"static: expected one of best, .*'tang' .did you mean"),
        (lambda c: c["static"].pop("form"), "form: missing"),
        (lambda c: c.update(extra=1), "extra: unknown key"),
    ],
)
def test_wrong_dynamic_files_are_named(tmp_path, change, message):
    with pytest.raises(FileFormatError, match=message):
        load_dynamic(changed(tmp_path, change, dynamic=True))


def test_unreadable_files(tmp_path):
    with pytest.raises(FileFormatError, match="No such file"):
        load_parameters(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text("name = ")
    with pytest.raises(FileFormatError, match="not TOML"):
        load_parameters(tmp_path / "bad.toml")


def test_a_scaled_model_is_not_written(tmp_path):
    with pytest.raises(InvalidInput, match="reference length"):
        save_parameters(muscle_model("best", 0.15), tmp_path / "set.toml")
    assert list(tmp_path.iterdir()) == []


def test_only_models_with_notes_that_can_be_read_are_written(tmp_path):
    path = tmp_path / "set.toml"
    for save, model in ((save_parameters, muscle_model("best")), (save_dynamic, dynamic_model("tang-3-31"))):
        for notes in ((1, 2), "one remark"):
            with pytest.raises(InvalidInput, match="notes to be a tuple of strings"):
                replace(model, notes=notes)
        with pytest.raises(InvalidInput, match="notes as a mapping"):
            save(model, path, notes=("a remark",))
        with pytest.raises(InvalidInput, match="expected model to be a"):
            save(3, path)
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_never_half_written(tmp_path):
    path = tmp_path / "set.toml"
    path.write_text("kept = true\n")
    with pytest.raises(TypeError):
        write_toml(path, {"good": 1, "bad": object()})
    with pytest.raises(FileNotWritten, match="make its folder first"):
        write_toml(tmp_path / "no-folder" / "set.toml", {"good": 1})
    assert path.read_text() == "kept = true\n"
    assert list(tmp_path.iterdir()) == [path]
