"""A preset computed again from its file alone: NumPy, linear programs of HiGHS, distances of MuJoCo's capsules."""

import itertools
import tomllib
from dataclasses import replace
from importlib.resources import files

import mujoco
import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import exo_pin as ep
from exo_pin.workspace import limb_loss

NAME = "four-linear-actuators-worn"
SIZES = (ep.Wearer(1.755, 85, "male"), ep.Wearer(1.525, 51, "female"), ep.Wearer(1.87, 111, "male"))
#: Of a linear actuator, m: the one assumption of the package that is not in the file.
RADIUS = 0.016
ELBOW = (0.0, np.radians(130.0))
LIMITS = ep.Criteria(
    names=("stroke", "forces", "shoulder_force", "cuff_pull", "elbow", "limb_loss", "clearance"),
    largest_shoulder_force=250.0,
    largest_cuff_pull=200.0,
    least_above_elbow=0.05,
    least_moment_without_limb=0.0,
    wearers=SIZES,
    elbow_range=ELBOW,
)


@pytest.fixture(scope="module")
def file():
    return tomllib.loads(files("exo_pin.design").joinpath("presets", "found", f"{NAME}.toml").read_text())


@pytest.fixture(scope="module")
def poses():
    flexion, abduction, internal = np.random.default_rng(11).uniform((0, -4, -20), (110, 96, 85), (60, 3)).T
    # By hand: the arm hangs along -z, x points forward, y to the left.
    turns = [
        Rotation.from_euler("Y", -f, degrees=True)
        * Rotation.from_euler("X", a, degrees=True)
        * Rotation.from_euler("Z", -i, degrees=True)
        for f, a, i in zip(flexion, abduction, internal, strict=True)
    ]
    exo = ep.load(NAME)
    np.testing.assert_allclose(
        Rotation.concatenate(turns).as_matrix(), exo.pose(flexion, abduction, internal).as_matrix(), atol=1e-12
    )
    return Rotation.concatenate(turns)


@pytest.fixture(scope="module")
def found(poses):
    return ep.load(NAME).workspace(poses, LIMITS)


def joints(file, R):
    """Joints on the frame and on the turned arm, m."""
    points = file["geometry"]["points"]
    return 1e-3 * np.array(points["base_mm"]), 1e-3 * np.array(points["platform_mm"]) @ R.T


def arms(file):
    """Mass and centre of mass, arm frame, of each person's arm in each posture, with the device's moving part."""
    device = file["arm"]["parts"][1]
    for size in SIZES:
        for bend in np.linspace(*ELBOW, 4):
            mass, centre = zip(*((m, c) for m, c, _ in replace(size, elbow_flexion=bend).segments()), strict=True)
            own = sum(mass)
            mass, centre = [*mass, device["mass_kg"]], [*centre, device["centre_of_mass_m"]]
            yield sum(mass), np.average(centre, axis=0, weights=mass), own


def bounds(file, lost=None):
    each = [(-limb["actuator"]["push_limit_N"], limb["actuator"]["pull_limit_N"]) for limb in file["limbs"]]
    return [(0.0, 0.0) if i == lost else pair for i, pair in enumerate(each)]


def spare_moment(moments, span, missing):
    """How far a moment lies inside of all that tensions within bounds make, by the facets of that polytope, N m."""
    low, high = np.array(span).T
    spare = np.inf
    for i, j in itertools.combinations(np.flatnonzero(high > low), 2):
        normal = np.cross(moments[:, i], moments[:, j])
        normal /= np.linalg.norm(normal)
        for outward in (normal, -normal):
            along = outward @ moments
            spare = min(spare, np.maximum(low * along, high * along).sum() - outward @ missing)
    return spare


def test_strokes(file, poses, found):
    for k, R in enumerate(poses.as_matrix()):
        base, ends = joints(file, R)
        length = np.linalg.norm(ends - base, axis=1)
        low, high = (
            1e-3 * np.array([limb["stroke"][key] for limb in file["limbs"]]) for key in ("shortest_mm", "longest_mm")
        )
        assert found.margins["stroke"][k] == pytest.approx(min((length - low).min(), (high - length).min()), abs=1e-12)
    assert found.met["stroke"].sum() > 40


@pytest.mark.full
def test_forces_with_all_limbs_and_without_one(file, poses, found):
    """Of four limbs the moments leave one freedom: f = f_0 + t n, and |F_s|² is a parabola over t."""
    for k, R in enumerate(poses.as_matrix()):
        base, ends = joints(file, R)
        along = (base - ends) / np.linalg.norm(base - ends, axis=1)[:, None]
        moments, freedom = np.cross(ends, along).T, np.linalg.svd(np.cross(ends, along).T)[2][3]
        largest, pull, whole, without = 0.0, 0.0, True, True
        spare = dict.fromkeys((None, 0, 1, 2, 3), np.inf)
        for mass, centre, own in arms(file):
            weight = mass * np.array([0.0, 0.0, -9.81])
            missing = -np.cross(R @ centre, weight)
            for lost in (None, 0, 1, 2, 3):
                span = bounds(file, lost)
                own_spare = spare_moment(moments, span, missing)
                held = own_spare >= 0.0
                if k % 6 == 0 and abs(own_spare) > 1e-6:
                    solved = linprog(np.zeros(4), A_eq=moments, b_eq=missing, bounds=span, method="highs")
                    assert held == (solved.status == 0)
                spare[lost] = min(spare[lost], own_spare)
                whole, without = whole and (held or lost is not None), without and (held or lost is None)
            if not whole:
                continue
            start = np.linalg.lstsq(moments, missing, rcond=None)[0]
            low, high = np.array(bounds(file)).T
            ends_of_t = np.sort(np.stack([(low - start) / freedom, (high - start) / freedom]), axis=0)
            push = -(along.T @ start) - weight
            change = -(along.T @ freedom)
            t = np.clip(-(push @ change) / (change @ change), ends_of_t[0].max(), ends_of_t[1].min())
            shoulder = push + t * change
            largest = max(largest, float(np.linalg.norm(shoulder)))
            # Cuff, shoulder and the weight of the wearer's own arm are in balance; along the arm is -z of its frame.
            cuff = -shoulder - own * np.array([0.0, 0.0, -9.81])
            pull = max(pull, abs(float(cuff @ -R[:, 2])))
        assert found.met["forces"][k] == whole
        assert found.met["limb_loss"][k] == (without and whole) or abs(found.margins["limb_loss"][k]) < 1e-6
        assert found.margins["forces"][k] == pytest.approx(spare[None], abs=1e-6)
        assert found.margins["limb_loss"][k] == pytest.approx(min(spare[i] for i in range(4)), abs=1e-6)
        if whole:
            assert found.magnitude[k] == pytest.approx(largest, rel=1e-6)
            assert found.margins["cuff_pull"][k] == pytest.approx(200.0 - pull, abs=1e-5)
    assert 0 < found.met["limb_loss"].sum() < 60


def test_the_cuff_ends_above_every_elbow(file, found):
    """A sleeve from 10 mm above the highest joint to 10 mm below the lowest; elbows by the table of de Leva (1996)."""
    lowest = min(point[2] for point in file["geometry"]["points"]["platform_mm"])
    elbow = min(1.755 * 281.7 / 1741.0, 1.525 * 275.1 / 1735.0, 1.87 * 281.7 / 1741.0)
    np.testing.assert_allclose(found.margins["elbow"], elbow - (10.0 - lowest) / 1e3 - 0.05, atol=1e-9)


@pytest.mark.full
def test_what_the_loss_of_a_limb_leaves(file, poses, found):
    """Three limbs are left: their moments decide, and with them the shoulder's force."""
    table = limb_loss(ep.load(NAME).mechanism, found)
    turns = poses.as_matrix()[found.inside]
    for lost in range(4):
        held, lacking, share, force = [], 0.0, 0.0, 0.0
        left = [i for i in range(4) if i != lost]
        for R in turns:
            base, ends = joints(file, R)
            along = (base - ends) / np.linalg.norm(base - ends, axis=1)[:, None]
            moments, spares, sizes = np.cross(ends, along).T, [], []
            for mass, centre, _ in arms(file):
                weight = mass * np.array([0.0, 0.0, -9.81])
                missing = -np.cross(R @ centre, weight)
                spares.append(spare_moment(moments, bounds(file, lost), missing))
                lacking = max(lacking, -spares[-1])
                share = max(share, -spares[-1] / np.linalg.norm(missing))
                f = np.linalg.solve(moments[:, left], missing)
                sizes.append(np.linalg.norm(along[left].T @ f + weight))
            held.append(min(spares) >= 0.0)
            force = max(force, *sizes) if held[-1] else force
        assert table["held"][lost] == pytest.approx(np.mean(held))
        assert table["missing_Nm"][lost] == pytest.approx(max(lacking, 0.0), abs=1e-6)
        assert table["missing_share"][lost] == pytest.approx(max(share, 0.0), abs=1e-6)
        assert table["shoulder_force_N"][lost] == pytest.approx(force, rel=1e-6)


def test_contact_force_balances_limbs_muscles_and_weights(file, poses, found):
    """The wearer's arm as a free body: limbs at the joints of the file, muscles along the lines of the model."""
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    person = ep.Person(1.755, 85, "male", elbow_flexion=40, degrees=True)
    some = poses[np.flatnonzero(found.inside)[:8]]
    contact, lines = ep.load(NAME).joint_contact(some, person, "least_effort"), person.limb_state(some)
    assert (contact.status == "ok").all()
    mass, centre = zip(*((m, c) for m, c, _ in person.segments()), strict=True)
    device = file["arm"]["parts"][1]
    low, high = np.array(bounds(file)).T
    for k, R in enumerate(some.as_matrix()):
        base, ends = joints(file, R)
        along = (base - ends) / np.linalg.norm(base - ends, axis=1)[:, None]
        f = contact.device_forces[k]
        assert ((low - 1e-6 <= f) & (f <= high + 1e-6)).all()
        weights = [*mass, device["mass_kg"]] * np.array([[0.0], [0.0], [-9.81]])
        places = np.array([*centre, device["centre_of_mass_m"]]) @ R.T
        force = along.T @ f + weights.sum(axis=1) + lines.pull[k].T @ contact.muscle_forces[k]
        moment = np.cross(ends, along).T @ f + np.cross(places, weights.T).sum(axis=0)
        moment += lines.moment[k].T @ contact.muscle_forces[k]
        np.testing.assert_allclose(contact.force[k], -force, atol=1e-6)
        np.testing.assert_allclose(moment, 0.0, atol=1e-7)


def test_clearance_by_mujoco(file, poses, found):
    exo = ep.load(NAME)
    body = ep.BodyShape.of(SIZES, exo.side, ELBOW)
    spec = mujoco.MjSpec()
    moving = [(spec.worldbody.add_body(mocap=True), capsule) for capsule in body.arm]
    still = [(spec.worldbody, capsule) for capsule in body.torso]
    for owner, capsule in (*moving, *still):
        owner.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=capsule[:6], size=[capsule[6], 0.0, 0.0]
        ) if np.linalg.norm(capsule[:3] - capsule[3:6]) > 1e-9 else owner.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=capsule[:3], size=[capsule[6], 0.0, 0.0]
        )
    for k, R in enumerate(poses.as_matrix()):
        base, ends = joints(file, R)
        scene = spec.copy()
        for a, b in zip(base, ends, strict=True):
            scene.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CAPSULE,
                fromto=[*a, *b],
                size=[RADIUS, 0.0, 0.0],
                name=f"limb{len(scene.geoms)}",
            )
        model = scene.compile()
        data = mujoco.MjData(model)
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, R.ravel())
        data.mocap_quat[:] = quaternion
        mujoco.mj_forward(model, data)
        limbs = [model.geom(i).id for i in range(model.ngeom) if model.geom(i).name.startswith("limb")]
        least = min(
            mujoco.mj_geomDistance(model, data, limb, other, 10.0, None)
            for limb in limbs
            for other in range(model.ngeom)
            if other != limb
        )
        assert found.margins["clearance"][k] == pytest.approx(least, abs=1e-6)
