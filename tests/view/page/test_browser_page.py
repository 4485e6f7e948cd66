"""What a browser shows: known points have the colours they should have, and the numbers stand on the page."""

import base64
import io

import numpy as np
import pytest
from PIL import Image
from scipy.spatial.transform import Rotation, Slerp

import exo_pin as ep
from exo_pin.core.errors import BrowserNotFound, MissingExtra
from exo_pin.person.limb.skeleton import bone_meshes
from exo_pin.view import Browser, Scene, find_browser
from exo_pin.view.colours import BLUE, GREEN, ORANGE, RED

pytest.importorskip("choreographer")
try:
    find_browser()
except BrowserNotFound as missing:
    pytest.skip(str(missing), allow_module_level=True)

SIZE = (960, 640)
EYE, TARGET, VIEW = np.array([0.85, 1.35, 0.35]), np.array([0.0, 0.02, -0.08]), 32.0
POSES = {"rest": (0, 0, 0), "raised": (60, 30, 0)}
PERSON = ep.Arm.from_anthropometry(1.75, 75, "male")


def pose(name):
    return ep.shoulder_rotation(*POSES[name], degrees=True)


def make_scene(**options):
    scene = Scene(ep.load("prototype").worn_by(PERSON), **options)
    scene.camera(EYE, TARGET, VIEW)
    return scene


@pytest.fixture(scope="module")
def browser():
    with Browser(SIZE) as window:
        yield window


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


def check_picture(image, scene, name):
    """Limbs, arm and arrows stand where the closed form and the forces say."""
    exo, orientation = scene.exo, pose(name)
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


@pytest.mark.parametrize("name", POSES)
def test_exported_page_shows_limbs_arm_and_arrows_where_they_are(browser, tmp_path, name):
    scene = make_scene(human=False)
    scene.show(pose(name))
    scene.save_html(tmp_path / "scene.html")
    browser.open((tmp_path / "scene.html").as_uri())
    check_picture(shot(browser), scene, name)


def test_exported_page_needs_no_network_and_shows_the_numbers(browser):
    scene = make_scene(human=False)
    answer = scene.show(pose("raised"))
    browser.open_html(scene.html())
    loaded = browser.evaluate("performance.getEntriesByType('resource').map((entry) => entry.name)")
    assert [name for name in loaded if not name.startswith(("data:", "blob:"))] == []
    text = browser.evaluate("document.getElementById('numbers').innerText")
    assert f"{answer.magnitude:.1f} N" in text
    assert f"{float(answer.determinant):+.3f}".replace("-", "−") in text
    assert "10 cm = 200 N" in browser.evaluate("document.getElementById('legend').innerText")
    labels = browser.evaluate("document.getElementById('labels').innerText")
    assert f"shoulder {answer.magnitude:.0f} N" in labels
    assert f"2 pulls {answer.actuator_forces[1]:.0f} N" in labels


def test_live_page_follows_the_pose(browser):
    scene = make_scene(human=False)
    try:
        browser.open(scene.serve(0))
        for name in POSES:
            answer = scene.show(pose(name))
            browser.wait_for(f"document.body.dataset.serial === '{scene.serial}'")
            check_picture(shot(browser), scene, name)
            assert f"{answer.magnitude:.1f} N" in browser.evaluate("document.getElementById('big').innerText")
    finally:
        scene.close()


def test_an_old_page_starts_afresh_with_a_new_server(browser):
    first, second = make_scene(human=False), Scene(ep.load("scenario-one"), human=False)
    first.points("cloud", [[0.3, 0.3, 0.3]], [1.0], "old")
    try:
        url = first.serve(0)
        browser.open(url)
        browser.evaluate("window.old = true")
        first.close()
        assert second.serve(int(url.split(":")[2].strip("/"))) == url
        browser.wait_for("window.old === undefined && document.body && document.body.dataset.state === 'drawn'")
        assert "Scenario One" in browser.evaluate("document.getElementById('title').textContent")
        assert "old" not in browser.evaluate("document.getElementById('legend').textContent")
    finally:
        first.close()
        second.close()


def test_shoulder_is_inside_the_rings_and_no_limb_in_the_chest_at_rest(browser):
    try:
        scene = make_scene(human=True)
    except MissingExtra as missing:
        pytest.skip(str(missing))
    browser.open_html(scene.html())
    image = shot(browser)
    exo = scene.exo
    state = exo.inverse_kinematics(Rotation.identity())
    # A limb that ran through the chest would be hidden by it; every limb is seen along its whole outer half.
    for i in range(3):
        a, b = exo.geometry.base_points[i], state.platform_points[i]
        for share in (0.15, 0.3, 0.45):
            assert pixel(image, b + share * (a - b)).max() < 0.4, (i, share)
    # Bright skin of the upper arm around O, in front of the dark cloth of the chest.
    assert chroma(pixel(image, [0.0, 0.03, -0.08])) @ chroma((0.86, 0.70, 0.60)) > 0.8


def test_recording_plays_by_itself_and_its_numbers_follow(browser, tmp_path):
    scene = make_scene(human=False, metres_per_newton=0.0005)
    times = np.linspace(0.0, 1.0, 7)
    ends = Rotation.concatenate([pose("rest"), pose("raised")])
    poses = Slerp([0.0, 1.0], ends)(times)
    recording = scene.record(poses, times)
    recording.save(tmp_path / "motion.html")
    browser.open((tmp_path / "motion.html").as_uri())
    browser.wait_for("document.body.dataset.frame !== undefined")
    first = browser.evaluate("document.body.dataset.frame")
    browser.wait_for(f"document.body.dataset.frame !== '{first}'")
    for frame, name in ((0, "rest"), (6, "raised")):
        browser.evaluate(f"showFrame({frame})")
        check_picture(shot(browser), scene, name)
        text = browser.evaluate("document.getElementById('big').innerText")
        assert f"{recording.reaction.magnitude[frame]:.1f} N" in text
    assert "1.00 s" in browser.evaluate("document.getElementById('clock').textContent")


def test_wearers_bones_and_muscles_move_and_change_colour(browser):
    """Without arrows and device in the way: bones are bright, muscles have the colour of their activation."""
    pytest.importorskip("myo_sim", reason="needs the extra person: pip install '.[person]'")
    wearer, device = ep.Person(1.75, 75, "male"), ep.load("four-cables")
    scene = device.view(person=wearer, metres_per_newton=1e-7)
    scene.camera(EYE, TARGET, VIEW)
    scene._stage.viewer["exo"].set_property("visible", False)
    poses, times = device.pose([10.0, 50.0], [20.0, 60.0], 0.0), [0.0, 1.0]
    # Part of the load, so that muscles work.
    recording = scene.record(poses, times, load=ep.Load([0.0, 0.0, -20.0], at=(0.0, 0.0, -0.3)))
    browser.open_html(recording.html())
    frames = recording._frames
    moving, coloured = frames["moving"], frames["coloured"]
    transforms = np.frombuffer(base64.b64decode(frames["transforms"]), "<f4").reshape(2, len(moving), 4, 4)
    colours = np.frombuffer(base64.b64decode(frames["colours"]), "<f4").reshape(2, len(coloured), 4)
    assert len(coloured) >= 10
    vertices = bone_meshes("left")["trunk"][0]
    images = []
    for frame in range(2):
        browser.evaluate(f"showFrame({frame})")
        image = shot(browser)
        images.append(image)
        trunk = transforms[frame, moving.index("/meshcat/wearer/bones/trunk")].T
        skull = vertices @ trunk[:3, :3].T + trunk[:3, 3]
        skull = skull[skull[:, 2] > skull[:, 2].max() - 0.08]
        nearest = skull[np.argmin(np.linalg.norm(skull - EYE, axis=1))]
        red, green, blue = pixel(image, nearest)
        assert red > 0.5
        assert red >= green >= blue
        # The middles of the muscles' parts that something else does not hide.
        seen = total = 0
        for k, path in enumerate(coloured):
            parts = [i for i, name in enumerate(moving) if name.startswith(f"{path}/")]
            for i in parts:
                matrix = transforms[frame, i].T
                got = pixel(image, matrix[:3, 3] + 0.5 * matrix[:3, 2])
                seen += chroma(got) @ chroma(colours[frame, k, :3]) > 0.97 and np.ptp(got) > 0.05
                total += 1
        assert seen > 0.6 * total
    assert np.abs(images[0] - images[1]).max() > 0.3


BOXES = """(() => {
  const boxes = [...document.querySelectorAll('#labels div')].filter((node) => node.style.display !== 'none');
  const cards = ['numbers', 'legend'].map((id) => document.getElementById(id));
  return [...boxes, ...cards].map((node) => {
    const box = node.getBoundingClientRect();
    return [box.left, box.top, box.right, box.bottom];
  });
})()"""
#: Where points are on the page, in pixels.
PIXELS = """(points) => points.map((at) => {
  const p = new MeshCat.THREE.Vector3(...at).applyMatrix4(viewer.scene.matrixWorld).project(viewer.camera);
  return [(p.x + 1) / 2 * innerWidth, (1 - p.y) / 2 * innerHeight];
})"""


@pytest.mark.parametrize("size", [(1280, 800), (420, 800)])
def test_panels_and_labels_keep_clear_of_each_other_and_of_the_device(browser, size):
    """On a wide page and a narrow one: no two boxes overlap, none leaves the page, no joint is under a panel."""
    scene = Scene(ep.load("prototype").worn_by(PERSON), human=False)
    browser.resize(size)
    try:
        for name in POSES:
            scene.show(pose(name))
            browser.open_html(scene.html())
            boxes = np.array(browser.evaluate(BOXES))
            # Every label has found a place, beside both panels.
            assert len(boxes) == len(scene._stage.panel("labels")) + 2
            left, top, right, bottom = boxes.T
            assert left.min() >= 0
            assert top.min() >= 0
            assert right.max() <= size[0]
            assert bottom.max() <= size[1]
            for i in range(len(boxes)):
                for k in range(i):
                    apart = right[i] <= left[k] or right[k] <= left[i] or bottom[i] <= top[k] or bottom[k] <= top[i]
                    assert apart, (name, boxes[i], boxes[k])
            joints = np.vstack(
                [scene.exo.geometry.base_points, scene.exo.inverse_kinematics(pose(name)).platform_points]
            )
            for x, y in browser.evaluate(f"({PIXELS})({joints.tolist()})"):
                assert 0 < x < size[0]
                assert 0 < y < size[1]
                for x0, y0, x1, y1 in boxes[-2:]:
                    assert not (x0 < x < x1 and y0 < y < y1)
    finally:
        browser.resize(SIZE)


def test_a_motion_draws_its_picture_with_its_numbers(browser):
    """What the canvas shows is drawn before a frame's number is set: a slow machine has both of one frame."""
    scene = make_scene(human=False)
    times = np.linspace(0.0, 1.0, 5)
    recording = scene.record(ep.shoulder_rotation(60 * times, 30, 0, degrees=True), times)
    browser.open_html(recording.html())
    browser.wait_for("document.body.dataset.frame !== undefined")
    browser.evaluate(
        "window.drawn = []; const before = viewer.renderer.render.bind(viewer.renderer);"
        "viewer.renderer.render = (...a) => { before(...a); window.drawn.push(document.body.dataset.frame"
        " + ':' + document.getElementById('clock').textContent); }; showFrame(3)"
    )
    # Drawn within the call, under the new clock, before the frame counts as shown.
    drawn = browser.evaluate("window.drawn")
    assert drawn
    assert drawn[0].endswith(":0.75 s")
    assert not drawn[0].startswith("3:")


def test_text_from_a_design_is_never_markup(browser):
    exo = ep.load("prototype").worn_by(PERSON)
    exo = exo.replace(title="<img src=x onerror=document.body.dataset.hacked=1></script>&\"'")
    scene = Scene(exo, human=False)
    scene.points("cloud", [[0.3, 0.3, 0.3]], [1.0], "<b>bold</b></script>")
    browser.open_html(scene.html())
    assert browser.evaluate("document.getElementById('title').textContent") == exo.mechanism.title
    assert browser.evaluate("document.body.dataset.hacked === undefined")
    assert "<b>bold</b></script>" in browser.evaluate("document.getElementById('legend').textContent")


def test_muscles_points_surface_and_ghost_are_drawn(browser):
    scene = make_scene(human=False, limbs="muscles")
    scene.show(pose("rest"), pressures=[0.0, 2e5, 4e5])
    before = shot_of(browser, scene)
    spot = np.array([0.25, 0.25, 0.2])
    scene.points("cloud", [spot], [3.0], "value, 1", limits=(0.0, 3.0), size=0.05)
    corners = [[0.1, 0.4, 0.1], [0.1, 0.4, 0.25], [0.1, 0.25, 0.25]]
    scene.surface("face", corners, [[0, 1, 2]], [0.0, 0.0, 0.0], "value, 1", limits=(0.0, 1.0))
    scene.ghost(ep.shoulder_rotation(0, 80, 0, degrees=True))
    after = shot_of(browser, scene)
    red, green, blue = pixel(after, spot)
    assert red > 0.8
    assert green > 0.7
    assert blue < 0.5
    face = pixel(after, np.mean(corners, axis=0))
    assert face[2] > face[0] + 0.05
    ghost = ep.shoulder_rotation(0, 80, 0, degrees=True).as_matrix() @ [0.0, 0.0, -0.2]
    assert pixel(after, ghost).mean() < pixel(before, ghost).mean() - 0.05
    # Full pressure is the bright end of the scale.
    a, b = scene.exo.geometry.base_points, scene.exo.inverse_kinematics(pose("rest")).platform_points
    brightness = [pixel(after, (a[i] + b[i]) / 2).mean() for i in range(3)]
    assert brightness[0] < brightness[1] < brightness[2]


def shot_of(browser, scene):
    browser.open_html(scene.html())
    return shot(browser)
