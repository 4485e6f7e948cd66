"""What a browser writes: numbers, labels and panels of the page, and when they change."""

from urllib.parse import urlsplit

import numpy as np
import pytest
from page_pictures import POSES, SIZE, make_scene, named_pose
from scenes import PERSON, panel

import exo_pin as ep
from exo_pin.view import Scene
from exo_pin.view.scene.panels import bar


@pytest.mark.full
def test_exported_page_needs_no_network_and_shows_the_numbers(browser):
    scene = make_scene(human=False)
    answer = scene.show(named_pose("raised"))
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


@pytest.mark.full
def test_an_old_page_starts_afresh_with_a_new_server(browser):
    first, second = make_scene(human=False), Scene(ep.load("scenario-one"), human=False)
    first._stage.set_panel("legend", {"scale": "old", "items": [], "bars": []})
    try:
        url = first.serve(0)
        browser.open(url)
        browser.evaluate("window.old = true")
        first.close()
        assert second.serve(urlsplit(url).port) == url
        browser.wait_for("window.old === undefined && document.body && document.body.dataset.state === 'drawn'")
        assert "Scenario One" in browser.evaluate("document.getElementById('title').textContent")
        assert "old" not in browser.evaluate("document.getElementById('legend').textContent")
    finally:
        first.close()
        second.close()


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


@pytest.mark.full
@pytest.mark.parametrize("size", [(1280, 800), (420, 800)])
def test_panels_and_labels_keep_clear_of_each_other_and_of_the_device(browser, size):
    """On a wide page and a narrow one: no two boxes overlap, none leaves the page, no joint is under a panel."""
    scene = Scene(ep.load("prototype").worn_by(PERSON), human=False)
    browser.resize(size)
    try:
        for name in POSES:
            scene.show(named_pose(name))
            browser.open_html(scene.html())
            boxes = np.array(browser.evaluate(BOXES))
            # Every label has found a place, beside both panels.
            assert len(boxes) == len(panel(scene, "labels")) + 2
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
                [scene.exo.geometry.base_points, scene.exo.inverse_kinematics(named_pose(name)).platform_points]
            )
            for x, y in browser.evaluate(f"({PIXELS})({joints.tolist()})"):
                assert 0 < x < size[0]
                assert 0 < y < size[1]
                for x0, y0, x1, y1 in boxes[-2:]:
                    assert not (x0 < x < x1 and y0 < y < y1)
            if size[0] > 719:
                # There is room beside all arrows.
                arrows = np.array([label["arrow"] for label in panel(scene, "labels")])
                along = np.linspace(arrows[:, 0], arrows[:, 1], 11).reshape(-1, 3)
                for x, y in browser.evaluate(f"({PIXELS})({along.tolist()})"):
                    assert not ((left < x) & (x < right) & (top < y) & (y < bottom))[:-2].any()
    finally:
        browser.resize(SIZE)


@pytest.mark.full
def test_a_motion_draws_its_picture_with_its_numbers(browser):
    """What the canvas shows is drawn before a frame's number is set: a slow machine has both of one frame."""
    scene = make_scene(human=False)
    times = np.linspace(0.0, 1.0, 5)
    recording = scene.record(ep.shoulder_rotation(60 * times, 30, 0, degrees=True), times)
    browser.open_html(recording.html())
    browser.wait_for("document.body.dataset.frame !== undefined")
    browser.evaluate("showFrame(0)")  # the motion stops: it might just show the frame that follows, and draw nothing
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


@pytest.mark.full
def test_text_from_a_design_is_never_markup(browser):
    exo = ep.load("prototype").worn_by(PERSON)
    exo = exo.replace(title="<img src=x onerror=document.body.dataset.hacked=1></script>&\"'")
    scene = Scene(exo, human=False)
    bold = bar("<b>bold</b></script>", 0.0, 1.0)
    scene._stage.set_panel("legend", {"scale": "", "items": [], "bars": [bold]})
    browser.open_html(scene.html())
    assert browser.evaluate("document.getElementById('title').textContent") == exo.mechanism.title
    assert browser.evaluate("document.body.dataset.hacked === undefined")
    assert "<b>bold</b></script>" in browser.evaluate("document.getElementById('legend').textContent")
