"""What a browser draws: points of the device, the arm and the wearer have the colours they should have.

Of the full set: a browser that draws without a graphics card takes long.
"""

import base64

import numpy as np
import pytest
from page_pictures import EYE, POSES, TARGET, VIEW, check_picture, chroma, make_scene, named_pose, pixel, shot
from scenes import panel
from scipy.spatial.transform import Rotation, Slerp

import exo_pin as ep
from exo_pin.person.limb.skeleton import bone_meshes
from exo_pin.view.page import live_server

pytestmark = pytest.mark.full


@pytest.mark.parametrize("name", POSES)
def test_exported_page_shows_limbs_arm_and_arrows_where_they_are(browser, tmp_path, name):
    scene = make_scene(human=False)
    scene.show(named_pose(name))
    scene.save_html(tmp_path / "scene.html")
    browser.open((tmp_path / "scene.html").as_uri())
    check_picture(shot(browser), scene, name)


@pytest.mark.parametrize("most_waiting", [live_server._MOST_WAITING, 0])
def test_live_page_follows_the_pose(browser, monkeypatch, most_waiting):
    """By changes, and by the whole scene anew as a browser that reads slowly gets it."""
    monkeypatch.setattr(live_server, "_MOST_WAITING", most_waiting)
    scene = make_scene(human=False)
    try:
        browser.open(scene.serve(0))
        for name in POSES:
            answer = scene.show(named_pose(name))
            browser.wait_for(f"document.body.dataset.serial === '{scene.serial}'")
            check_picture(shot(browser), scene, name)
            assert f"{answer.magnitude:.1f} N" in browser.evaluate("document.getElementById('big').innerText")
    finally:
        scene.close()


#: Moves the sliders of a page as a hand does, to degrees.
SLIDE = """((angles) => angles.forEach((angle, i) => {
  inputs[i].value = angle;
  inputs[i].dispatchEvent(new Event("input"));
}))"""


def test_sliders_of_the_live_page_move_arm_and_forces_and_its_buttons_the_camera(browser):
    scene = make_scene(human=False)
    try:
        browser.open(scene.serve(0))
        for name, angles in POSES.items():
            browser.evaluate(f"{SLIDE}({list(angles)})")
            browser.wait_for("wanted === null")
            browser.wait_for(f"document.body.dataset.serial === '{scene.serial}'")
            answer = scene.exo.reaction(named_pose(name))
            check_picture(shot(browser), scene, name)
            text = browser.evaluate("document.getElementById('numbers').innerText")
            assert f"{answer.magnitude:.1f} N" in text
            assert answer.verdict in text
        sides = {side["name"]: side for side in panel(scene, "camera")["sides"]}
        for name, side in sides.items():
            browser.evaluate(
                f"[...document.querySelectorAll('#views button')].find((b) => b.innerText === '{name}').click()"
            )
            x, y, z = side["position"]
            np.testing.assert_allclose(browser.evaluate("viewer.camera.position.toArray()"), [x, z, -y], atol=1e-6)
            # What is to be seen is on the page, clear of the cards.
            assert browser.evaluate("freeArea().h") > 100
    finally:
        scene.close()


def test_recording_plays_by_itself_and_its_numbers_follow(browser, tmp_path):
    scene = make_scene(human=False, metres_per_newton=0.0005)
    times = np.linspace(0.0, 1.0, 7)
    ends = Rotation.concatenate([named_pose("rest"), named_pose("raised")])
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
    # A frame shows the device as a whole where it reaches the pose.
    for part in ("visuals", "cables", "harness", "cuff"):
        scene._stage.viewer[f"exo/{part}"].set_property("visible", False)
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
