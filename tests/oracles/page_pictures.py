"""Pictures of a page in a browser: where points of a scene should be, and which colour is there."""

import io

import numpy as np
from PIL import Image
from scenes import PERSON

import exo_pin as ep
from exo_pin.view import Scene
from exo_pin.view.colours import BLUE, GREEN, ORANGE, RED

SIZE = (960, 640)
EYE, TARGET, VIEW = np.array([0.85, 1.35, 0.35]), np.array([0.0, 0.02, -0.08]), 32.0
POSES = {"rest": (0, 0, 0), "raised": (60, 30, 0)}


def named_pose(name):
    return ep.shoulder_rotation(*POSES[name], degrees=True)


def make_scene(**options):
    scene = Scene(ep.load("prototype").worn_by(PERSON), **options)
    scene.camera(EYE, TARGET, VIEW)
    return scene


def project(point):
    """Pixel of a point: a pinhole camera, worked out here and not by the viewer."""
    ahead = TARGET - EYE
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    seen = np.asarray(point) - EYE
    focal = SIZE[1] / 2 / np.tan(np.radians(VIEW) / 2)
    depth = seen @ ahead
    return SIZE[0] / 2 + focal * (seen @ right) / depth, SIZE[1] / 2 - focal * (seen @ up) / depth


def pixel(image, point):
    """Median colour of the 3 by 3 pixels where a point should be, 0 to 1."""
    x, y = (round(part) for part in project(point))
    return np.median(image[y - 1 : y + 2, x - 1 : x + 2].reshape(-1, 3), axis=0)


def chroma(colour):
    """Hue and saturation: the colour less its grey, scaled to length 1."""
    away = np.asarray(colour, dtype=float) - np.mean(colour)
    return away / max(np.linalg.norm(away), 1e-9)


def rgb(code):
    return np.array([int(code[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0


def assert_is(image, point, code):
    got = pixel(image, point)
    assert np.ptp(got) > 0.15, f"grey {got} where {code} is expected"
    likeness = {name: chroma(got) @ chroma(rgb(name)) for name in (BLUE, GREEN, ORANGE, RED)}
    assert max(likeness, key=likeness.get) == code, (code, got, likeness)
    assert likeness[code] > 0.95


def shot(browser):
    browser.evaluate("document.body.classList.add('still'); document.getElementById('labels').style.display = 'none'")
    return np.asarray(Image.open(io.BytesIO(browser.screenshot())).convert("RGB")) / 255.0


def shot_of(browser, scene):
    browser.open_html(scene.html())
    return shot(browser)


def check_picture(image, scene, name):
    """Limbs, arm and arrows stand where the closed form and the forces say."""
    exo, orientation = scene.exo, named_pose(name)
    state = exo.inverse_kinematics(orientation)
    answer = exo.reaction(orientation)
    R = orientation.as_matrix()
    # The middle of an arrow is its shaft.
    centre = R @ exo.arm.centre_of_mass
    weight = exo.arm.mass * exo.mechanism.gravity
    assert_is(image, centre + 0.3 * scene.metres_per_newton * weight, GREEN)
    assert_is(image, 0.3 * scene.metres_per_newton * answer.shoulder_force, RED)
    # The arm is skin: light, red above green above blue.
    red, green, blue = pixel(image, R @ [0.0, 0.0, -0.07 if name == "rest" else -0.23])
    assert red > green + 0.03 > blue + 0.06
    assert red > 0.45
    # A limb's outer half is near black, its inner one light grey; both are known by their contrast to the body.
    for i in range(3):
        a, b = exo.geometry.base_points[i], state.platform_points[i]
        dark = pixel(image, b + 0.35 * (a - b))
        assert dark.max() < 0.35, (i, dark)
        if (i, name) == (2, "raised"):
            continue  # the reaction's arrow stands before it
        bright = pixel(image, a + 0.2 * (b - a))
        assert np.ptp(bright) < 0.08, (i, bright)
        assert bright.mean() > 0.35, (i, bright)
    if name == "raised":
        for i, tension in enumerate(answer.actuator_forces):
            b, s = state.platform_points[i], state.directions[i]
            outward = b - (b @ s) * s
            beside = b + 0.032 * outward / np.linalg.norm(outward)
            reach = scene.metres_per_newton * abs(tension)
            assert_is(image, beside - 0.4 * reach * s, BLUE if tension > 0 else ORANGE)
