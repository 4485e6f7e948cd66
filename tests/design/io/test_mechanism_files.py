"""Files of designs: they come back bit for bit, cite their sources, and say what is wrong."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from same_records import same
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin import FileFormatError, UnknownName
from exo_pin.core.errors import FileNotWritten
from exo_pin.design import (
    Arm,
    Limb,
    LimbBody,
    LimbGuide,
    Mechanism,
    Shoulder,
    Stroke,
    WristGeometry,
    preset,
    preset_file,
    presets,
    published,
)
from exo_pin.design.io.mechanism_files import read_mechanism, write_mechanism


def test_the_published_mechanisms():
    assert published() == ["appendix-d", "optimised-table-5-3", "optimised-table-c-2", "prototype", "scenario-one"]
    found = {"four-cables", "four-cables-worn", "four-linear-actuators", "four-muscle-cables", "three-linear-actuators"}
    found |= {"four-linear-actuators-worn", "six-cables"}
    assert not set(published()) & found
    assert set(presets()) == set(published()) | found
    assert preset("prototype").geometry.circles.r_A == pytest.approx(0.1363)
    assert preset("scenario-one").arm is None
    assert preset("optimised-table-c-2").arm is None
    assert preset("appendix-d").arm.mass == 2.0
    assert preset("appendix-d").arm.inertia is None


@pytest.mark.parametrize("name", presets())
@pytest.mark.parametrize("side", ["left", "right"])
def test_files_come_back_bit_for_bit(name, side, tmp_path):
    mechanism = preset(name).on_side(side)
    write_mechanism(mechanism, tmp_path / "a.toml")
    back = read_mechanism(tmp_path / "a.toml")
    assert same(mechanism, back)
    write_mechanism(back, tmp_path / "b.toml")
    assert (tmp_path / "a.toml").read_bytes() == (tmp_path / "b.toml").read_bytes()


def test_a_design_of_the_users_own_comes_back(tmp_path):
    rng = np.random.default_rng(0)
    person = Arm.from_anthropometry(1.75, 75, "male", elbow_flexion=1.2, payload=0.5)
    device = Arm(0.4, [0, 0, -0.1], np.diag([1e-3, 1e-3, 1e-3]), device=True)
    geometry = WristGeometry(
        rng.normal(size=(4, 3)) * 0.1, rng.normal(size=(4, 3)) * 0.1, neutral=Rotation.from_rotvec([0.1, 0.2, 0.3])
    )
    mechanism = Mechanism(
        geometry,
        arm=person + device,
        limbs=(
            Limb(
                "UPU", LimbBody.rod(0.1, 0.2, 0.01), LimbBody.rod(0.05, 0.2, 0.005), Stroke(0.2, 0.75, 1.05, 0.1), 1.6
            ),
            Limb("SPS"),
            Limb("SPS", stroke=Stroke(0.2, 0.75, 1.05)),
            Limb("UPU"),
        ),
        shoulder=Shoulder(0.1, 0.2),
        gravity=[1.0, 0.0, -9.7],
        name="mine",
        title="a title",
        sources={"arm": "measured"},
    )
    write_mechanism(mechanism, tmp_path / "mine.toml")
    assert same(mechanism, read_mechanism(tmp_path / "mine.toml"))
    assert list(tmp_path.iterdir()) == [tmp_path / "mine.toml"]


def test_arms_that_are_no_more_their_wearers_come_back(tmp_path):
    person = Arm.from_anthropometry(1.75, 75, "male", payload=0.5)
    device = Arm(0.4, [0, 0, -0.1], np.diag([1e-3, 1e-3, 1e-3]), device=True)
    arms = (
        person,
        replace(person, mass=6.0),
        replace(person, body_mass=80.0) + device,
        replace(person, inertia=1.1 * person.inertia),
        replace(person, centre_of_mass=person.centre_of_mass + 0.01),
        Arm(4.0, [0, 0, -0.3], body_mass=70.0),
    )
    for number, arm in enumerate(arms):
        path = tmp_path / f"{number}.toml"
        write_mechanism(preset("prototype").replace(arm=arm), path)
        again = read_mechanism(path).arm
        assert same(again, arm), number
        assert again.body_mass == arm.body_mass
        assert same(again.wearer, arm.wearer)
        # A person's size stands for the arm only where it says all of it.
        assert (list(tomllib.loads(path.read_text())["arm"]) == ["wearer"]) is (number == 0)


def test_every_source_comes_back(tmp_path):
    """Of every table, or of what the file has no table for; written in one place, read beside a table too."""
    rod, guide = LimbBody.rod(0.1, 0.2, 0.01), LimbGuide(40.0, 30.0)
    device = Arm(0.4, [0, 0, -0.1], np.diag([1e-3, 1e-3, 1e-3]), device=True)
    limb = Limb("UPU", rod, rod, Stroke(0.2, 0.75, 1.05), guide=guide)
    beside = [
        "mechanism",
        "geometry",
        "geometry.circles",
        "arm",
        "arm.parts[0]",
        "arm.parts[1]",
        "shoulder",
        "limbs[0]",
        "limbs[0].stroke",
        "limbs[1].base_body",
        "limbs[1].platform_body",
        "limbs[2].guide",
    ]
    elsewhere = [
        "arm.parts[2]",
        "limbs[3]",
        "limbs[00]",
        "geometry.points",
        "limbs[0].stroke.nominal",
        "limbs",
        "",
        "?",
    ]
    mechanism = Mechanism(
        preset("prototype").geometry,
        arm=Arm.from_anthropometry(1.75, 75, "male") + device,
        limbs=(limb,) * 3,
        shoulder=Shoulder(0.1, 0.2),
        sources={name: f"source of {name!r}" for name in beside + elsewhere},
    )
    path = tmp_path / "cited.toml"
    write_mechanism(mechanism, path)
    assert read_mechanism(path).sources == mechanism.sources
    table = tomllib.loads(path.read_text())
    assert table["sources"] == mechanism.sources
    table["limbs"][0]["stroke"]["source"] = table["sources"].pop("limbs[0].stroke")
    path.write_text(tomli_w.dumps(table))
    assert read_mechanism(path).sources == mechanism.sources
    table["limbs"][0]["source"] = "another"
    path.write_text(tomli_w.dumps(table))
    with pytest.raises(FileFormatError, match="given twice"):
        read_mechanism(path)


GOOD = """
schema = 1
name = "mine"
[geometry.points]
base_m = [[0.1, -0.05, 0.0], [0.0, -0.05, 0.1], [-0.1, -0.05, 0.0]]
platform_m = [[0.05, 0.02, -0.2], [0.0, 0.05, -0.2], [-0.05, 0.03, -0.2]]
[arm]
mass_kg = 1.0
centre_of_mass_m = [0.0, 0.0, -0.2]
"""


@pytest.mark.parametrize(
    ("old", "new", "key", "message"),
    [
        ("mass_kg = 1.0", "", "arm.mass_kg or mass_g", "missing"),
        ("mass_kg = 1.0", "mass_kg = 1.0\nmas_g = 3", "arm.mas_g", "unknown key"),
        ("mass_kg = 1.0", "mass_kg = 1.0\nmass_g = 3", "arm.mass_kg and mass_g", "twice"),
        ("mass_kg = 1.0", "mass_lb = 1.0", "arm.mass_kg or mass_g", "missing"),
        ("mass_kg = 1.0", "mass_kg = '1'", "arm.mass_kg", "real numbers"),
        ("mass_kg = 1.0", "mass_kg = nan", "arm.mass_kg", "finite"),
        ("mass_kg = 1.0", "mass_kg = -1.0", None, "above zero"),
        ("schema = 1", "schema = 2", "schema", "schema 1"),
        ("schema = 1", "", "schema", "missing"),
        ('name = "mine"', "", "name", "missing"),
        ('name = "mine"', 'name = "mine"\nside = "up"', "side", "left, right"),
        ("base_m", "base_mm", None, "away from O|lies"),
        ("[arm]", "[arms]", "arms", "unknown key"),
        ("[0.0, 0.0, -0.2]", "[0.0, -0.2]", "arm.centre_of_mass_m", r"shape \(3,\)"),
        ("[arm]", "[[limbs]]\nkind = 'RRR'\n[arm]", "limbs[0].kind", "UPU, SPS"),
        ("[arm]", "[[limbs]]\nkind = 'UPU'\n[arm]", None, "expected 3 limbs"),
        ("schema = 1", "schema = ", None, "not TOML"),
    ],
)
def test_a_wrong_file_is_told_what_and_where(tmp_path, old, new, key, message):
    path = tmp_path / "mine.toml"
    path.write_text(GOOD)
    read_mechanism(path)
    if old == "base_m":
        # Millimetres where metres stand: a platform beside a base 1000 times smaller is still a geometry, so the
        # opposite slip, metres typed as millimetres' digits, is what can be told.
        path.write_text(GOOD.replace("base_m = [[0.1", "base_m = [[100.0"))
        message, key = "millimetres", None
    else:
        path.write_text(GOOD.replace(old, new, 1))
    with pytest.raises(FileFormatError, match=message) as caught:
        read_mechanism(path)
    assert str(path) in str(caught.value)
    assert caught.value.path == str(path)
    if key is not None:
        assert caught.value.key == key


def test_unreadable_files_and_unknown_presets(tmp_path):
    with pytest.raises(FileFormatError, match="cannot be read"):
        read_mechanism(tmp_path / "none.toml")
    with pytest.raises(UnknownName, match="did you mean 'prototype'"):
        preset("prototyp")


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.toml"
    write_mechanism(preset("prototype"), path)
    before = path.read_bytes()
    monkeypatch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(OSError("full")))
    with pytest.raises(FileNotWritten, match="full"):
        write_mechanism(preset("appendix-d"), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_presets_cite_their_source():
    from importlib.resources import files

    for name in published():
        data = tomllib.loads((files("exo_pin.design") / "presets" / f"{name}.toml").read_text(encoding="utf-8"))
        assert "Tang" in data["source"]
        assert data["geometry"]["source"]


def test_a_changed_design_does_not_cite_the_source_for_its_own_numbers(tmp_path):
    exo = ep.load("optimised-table-5-3")
    old = exo.mechanism.sources
    wider = exo.replace(geometry=exo.geometry.replace(r_A=0.2))
    assert wider.mechanism.sources["geometry"] == f"changed from: {old['geometry']}"
    assert wider.mechanism.sources["mechanism"] == f"changed from: {old['mechanism']}"
    again = wider.replace(geometry=wider.geometry.replace(r_A=0.21))
    assert again.mechanism.sources == wider.mechanism.sources
    again.save(tmp_path / "mine.toml")
    assert ep.load(tmp_path / "mine.toml").mechanism.sources == wider.mechanism.sources
    # Nothing changed, nothing to say.
    assert exo.replace(geometry=exo.geometry).mechanism.sources == old
    # An arm's source goes with the arm.
    worn = ep.load("prototype").worn_by(ep.Arm.from_anthropometry(1.75, 75, "male"))
    assert worn.replace(arm=ep.Arm(2.0, [0, 0, -0.2])).mechanism.sources.keys() <= worn.mechanism.sources.keys()


def test_metres_under_a_key_in_millimetres_are_refused(tmp_path):
    path, geometry = tmp_path / "own.toml", preset("four-cables").geometry
    base, platform = geometry.base_points.tolist(), geometry.platform_points.tolist()
    path.write_text(f'schema = 1\nname = "own"\n[geometry.points]\nbase_mm = {base}\nplatform_mm = {platform}\n')
    with pytest.raises(FileFormatError, match=r"geometry.points: the farthest joint is 0\.3.* mm .*metres"):
        read_mechanism(path)


def stroke_file(stroke):
    text = preset_file("four-cables")
    start = text.index("stroke = ")
    return text[:start] + f"stroke = {{ {stroke} }}" + text[text.index("\n", start) :]


def test_stroke_can_be_two_lengths_between_the_joints(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(stroke_file("shortest_mm = 210, longest_m = 0.4"))
    stroke = read_mechanism(path).limbs[0].stroke
    assert stroke.end_fitting == 0.0
    assert stroke.nominal_length * stroke.shortest == pytest.approx(0.21)
    assert stroke.nominal_length * stroke.longest == 0.4


@pytest.mark.parametrize(
    ("stroke", "message"),
    [
        ("shortest_mm = 210", "limbs\\[0\\].stroke.longest: missing"),
        ("shortest_mm = 410, longest_mm = 400", "at most the longest, 0.4 m; got 0.41 m"),
        ("shortest_mm = 210, longest_mm = 400, nominal_mm = 300", "unknown key"),
    ],
)
def test_wrong_lengths_of_a_stroke_are_named(tmp_path, stroke, message):
    path = tmp_path / "own.toml"
    path.write_text(stroke_file(stroke))
    with pytest.raises(FileFormatError, match=message):
        read_mechanism(path)
