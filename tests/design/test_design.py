"""Mechanisms as data: published parameter sets, files, and what bad input is told."""

import dataclasses
import re
import tomllib

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.core.conventions import MIRROR
from exo_pin.core.errors import FileFormatError, FileNotWritten, InvalidInput, MissingData, UnknownName
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
    presets,
    read_mechanism,
    write_mechanism,
)
from exo_pin.load_case import Load, Motion

TRIANGLE = np.array([[0.1, -0.05, 0.0], [0.0, -0.05, 0.1], [-0.1, -0.05, 0.0]])


def same(a, b):
    """Whether two records hold the same values, bit for bit."""
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if isinstance(a, Rotation):
        return np.array_equal(a.as_quat(), b.as_quat())
    if isinstance(a, tuple):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, Arm) and a.parts == (a,):
        return all(same(getattr(a, n), getattr(b, n)) for n in ("mass", "centre_of_mass", "inertia", "device"))
    if hasattr(a, "__dataclass_fields__"):
        return all(same(getattr(a, name), getattr(b, name)) for name in a.__dataclass_fields__)
    return a == b


def test_the_published_mechanisms():
    assert presets() == ["appendix-d", "optimised-table-5-3", "optimised-table-c-2", "prototype", "scenario-one"]
    assert preset("prototype").geometry.circles.r_A == pytest.approx(0.1363)
    assert preset("scenario-one").arm is None
    assert preset("optimised-table-c-2").arm is None
    assert preset("appendix-d").arm.mass == 2.0
    assert preset("appendix-d").arm.inertia is None


def test_prototype_points_and_estimates():
    mechanism = preset("prototype")
    np.testing.assert_allclose(mechanism.geometry.base_points[:, 1], -0.078)
    np.testing.assert_allclose(mechanism.geometry.platform_points[:, 2], -0.2)
    assert [limb.stroke.nominal_length for limb in mechanism.limbs] == [0.15, 0.25, 0.25]
    for index in range(3):
        assert f"limbs[{index}].stroke.end_fitting" in mechanism.estimated
    assert "Table 5-3" in mechanism.sources["geometry"]


def test_inertia_of_table_5_4():
    arm = preset("prototype").arm
    np.testing.assert_allclose(np.linalg.eigvalsh(arm.inertia), [0.00107, 0.00390, 0.00402], atol=6e-6)
    printed = [
        [27867611.9, -21184.2, 319504.5],
        [-21184.2, 27638169.9, -2649709.2],
        [319504.5, -2649709.3, 1419768.2],
    ]
    # Read as a tensor, no body can have it.
    with pytest.raises(InvalidInput, match="negative"):
        Arm.from_inertia_about_origin(0.65656, [-0.0026, 0.0227, -0.1897], np.array(printed) * 1e-9)


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


def test_every_source_comes_back(tmp_path):
    """Written beside what it speaks of, in every table, or by its name where the file has no such table."""
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
    written = tomllib.loads(path.read_text())
    assert written["arm"]["parts"][0]["source"] == "source of 'arm.parts[0]'"
    assert written["limbs"][0]["stroke"]["source"] == "source of 'limbs[0].stroke'"
    assert written["limbs"][2]["guide"]["source"] == "source of 'limbs[2].guide'"
    assert set(written["sources"]) == set(elsewhere)
    path.write_text(path.read_text() + '"limbs[0]" = "another"\n')
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
def test_error_names_the_file_and_the_key(tmp_path, old, new, key, message):
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


def test_records_are_frozen_copies():
    points = TRIANGLE.copy()
    geometry = WristGeometry(points, points - [0, 0, 0.2])
    points[0] = 7.0
    assert geometry.base_points[0, 0] == 0.1
    with pytest.raises(ValueError, match="read-only"):
        geometry.base_points[0, 0] = 1.0


def test_replacing_dimensions():
    geometry = preset("prototype").geometry
    wider = geometry.replace(r_A=0.15)
    np.testing.assert_allclose(np.hypot(wider.base_points[:, 0], wider.base_points[:, 2]), 0.15)
    np.testing.assert_array_equal(wider.platform_points, geometry.platform_points)
    turned = geometry.replace(alpha_A=[0.1, 0.9, 2.0])
    # α_A = α_B by design, so both turn together.
    np.testing.assert_array_equal(turned.circles.alpha_B, [0.1, 0.9, 2.0])
    with pytest.raises(InvalidInput, match="points, not circles"):
        preset("appendix-d").geometry.replace(r_A=0.1)
    with pytest.raises(UnknownName, match="r_C"):
        geometry.replace(r_C=0.1)
    four = preset("prototype").replace(geometry=geometry.replace(alpha_A=[0.1, 0.9, 2.0, 3.0]), limbs=(Limb(),) * 4)
    assert four.limb_count == 4


def test_mirroring_twice_is_the_identity():
    mechanism = preset("prototype")
    assert same(mechanism, mechanism.mirrored().mirrored())
    right = mechanism.mirrored()
    np.testing.assert_array_equal(right.geometry.base_points, mechanism.geometry.base_points @ MIRROR)
    np.testing.assert_array_equal(right.arm.inertia, MIRROR @ mechanism.arm.inertia @ MIRROR)
    assert right.side == "right"


def test_arms_add_as_bodies_do():
    rng = np.random.default_rng(1)
    points, masses = rng.normal(size=(40, 3)) * 0.1, rng.random(40)

    def body(selection, device=False):
        m, p = masses[selection], points[selection]
        about_origin = sum(w * (x @ x * np.eye(3) - np.outer(x, x)) for w, x in zip(m, p, strict=True))
        return Arm.from_inertia_about_origin(m.sum(), m @ p / m.sum(), about_origin, device=device)

    total = body(slice(0, 15)) + body(slice(15, 40), device=True)
    whole = body(slice(0, 40))
    assert total.mass == pytest.approx(whole.mass)
    np.testing.assert_allclose(total.centre_of_mass, whole.centre_of_mass, atol=1e-15)
    np.testing.assert_allclose(total.inertia, whole.inertia, atol=1e-15)
    assert total.person.mass == pytest.approx(masses[:15].sum())
    assert not total.device
    assert (total + Arm(1.0, [0, 0, 0])).inertia is None
    with pytest.raises(MissingData):
        _ = Arm(1.0, [0, 0, 0]).inertia_about_origin


def test_a_changed_arm_is_a_body_of_its_own():
    person = Arm.from_anthropometry(1.75, 75, "male")
    device = preset("prototype").arm
    heavier = dataclasses.replace(person, mass=6.0)
    assert heavier.person.mass == 6.0
    assert (heavier + device).mass == pytest.approx(6.0 + device.mass)
    assert heavier.mirrored().mass == 6.0
    assert dataclasses.replace(person + device, mass=9.0).parts[0].mass == 9.0


def test_a_left_geometry_is_refused_on_a_right_shoulder():
    with pytest.raises(InvalidInput, match="mirrored"):
        preset("prototype").replace(side="right")


def test_arm_of_a_person():
    arm = Arm.from_anthropometry(1.741, 73.0, "male")
    # The table's own person: 4.94 % of body mass; lengths 281.7, 268.9 and 86.2 mm.
    assert arm.mass == pytest.approx(0.0494 * 73.0)
    assert arm.body_mass == 73.0
    by_hand = (
        -(0.0271 * 0.5772 * 0.2817 + 0.0162 * (0.2817 + 0.4574 * 0.2689) + 0.0061 * (0.2817 + 0.2689 + 0.79 * 0.0862))
        / 0.0494
    )
    np.testing.assert_allclose(arm.centre_of_mass, [0, 0, by_hand], atol=1e-12)
    bent = Arm.from_anthropometry(1.741, 73.0, "male", elbow_flexion=90, degrees=True)
    assert bent.centre_of_mass[0] > 0.05
    assert bent.centre_of_mass[2] > arm.centre_of_mass[2]
    loaded = Arm.from_anthropometry(1.741, 73.0, "male", payload=1.0)
    moved = loaded.mass * loaded.centre_of_mass[2] - arm.mass * arm.centre_of_mass[2]
    assert moved == pytest.approx(-(0.2817 + 0.2689 + 0.0862))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Arm(0.0, [0, 0, 0]), "mass"),
        (lambda: Arm(1.0, [0, 0, -190]), "millimetres"),
        (lambda: Arm(1.0, [0, 0, 0], np.diag([1, 1, 3])), "triangle"),
        (lambda: Arm(1.0, [0, 0, 0], [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]), "symmetric"),
        (lambda: Arm(656.56, [0, 0, 0]), "grams"),
        (lambda: Arm.from_inertia_about_origin(0.656, [0, 0, -0.19], np.diag([2.8e7, 2.8e7, 1.4e6])), "g mm²"),
        (lambda: Arm(1.0, [0, 0, 0], device="no"), "device"),
        (lambda: preset("prototype").replace(gravity=[0, 0, -9810]), "mm/s²"),
        (lambda: preset("prototype").replace(limbs=Limb()), "of Limb records"),
        (lambda: preset("prototype").replace(name=None), "name"),
        (lambda: preset("prototype").replace(estimated="x"), "estimated"),
        (lambda: Load([1, 2, 3], moment=[[1, 2], [3]]), "real numbers"),
        (lambda: Load(np.ma.masked_array([1, 2, 3], [0, 1, 0])), "real numbers"),
        (lambda: Motion([1e8, 0, 0], [0, 0, 0]), "below"),
        (lambda: Arm.from_anthropometry(1.75, 75, []), "female, male"),
        (lambda: Arm.from_anthropometry(175, 75, "male"), "0.5 to 2.6 m"),
        (lambda: Arm.from_anthropometry(1.75, 75, "man"), "female, male"),
        (lambda: Arm.from_anthropometry(1.75, 75, "male", elbow_flexion=90), "rad"),
        (lambda: WristGeometry(TRIANGLE[:2], TRIANGLE[:2]), "at least 3"),
        (lambda: WristGeometry(TRIANGLE * 1000, TRIANGLE), "millimetres"),
        (lambda: WristGeometry(TRIANGLE, TRIANGLE), "line through O"),
        (lambda: WristGeometry(TRIANGLE, np.zeros((3, 3))), "away from O"),
        (lambda: WristGeometry(TRIANGLE, np.full((3, 3), np.nan)), "finite"),
        (lambda: WristGeometry.from_circles(0.1, 0.1, 0.1, 0.1, [31, 60, 120]), "degrees"),
        (lambda: WristGeometry.from_circles(-0.1, 0.1, 0.1, 0.1, [1, 2, 3]), "r_A"),
        (lambda: Limb("PUU"), "UPU"),
        (lambda: LimbBody(1.0, 0.1, 0.1, 0.3), "triangle"),
        (lambda: Stroke(0.1, 1.0, 0.75), "shortest"),
        (lambda: Load([1, 2]), "force"),
        (lambda: Load([1, 2, 3], frame="torso"), "arm, base"),
        (lambda: Motion([np.inf, 0, 0], [0, 0, 0]), "finite"),
        (lambda: Mechanism("prototype"), "WristGeometry"),
        (lambda: preset("prototype").replace(limbs=(Limb(),) * 4), "expected 3 limbs"),
        (lambda: preset("prototype").replace(legs=3), "legs"),
    ],
)
def test_bad_records_are_refused(make, message):
    with pytest.raises(InvalidInput, match=re.escape(message)):
        make()


def test_shoulder_range_is_a_diamond():
    shoulder = preset("prototype").shoulder
    poses = Rotation.from_euler("YXZ", [[0, 90, 0], [50, 90, 90], [0, 0, 0], [0, 0, 10], [0, -4, 5]], degrees=True)
    assert shoulder.allows(poses).tolist() == [True, True, True, False, False]
    # (0, 90, 96) is also (180, 90, -84), and the unit turns freely about Y.
    assert shoulder.allows(Rotation.from_euler("YXZ", [0, 90, 96], degrees=True))
    assert Shoulder().allows(poses).all()


def test_presets_cite_their_source():
    from importlib.resources import files

    for name in presets():
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
