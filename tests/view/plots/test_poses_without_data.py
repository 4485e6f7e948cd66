"""Pictures of poses that the data of a spring do not cover: marked as such, and not as singular or not held."""

import numpy as np
import pytest
from places import URDF

import exo_pin as ep
from exo_pin.cli import main
from exo_pin.device import Route, Spring, TableLaw
from exo_pin.study import StudyTable, compare

LABEL = "not evaluated: no data of a spring"


@pytest.fixture(scope="module")
def exo():
    route = Route.over(("universe", (0.0, 0.0, -0.4)), ("arm", (0.0, 0.0, -0.2)))
    law = TableLaw((0.285, 0.4, 0.9), (-30.0, -20.0, -10.0))
    return ep.load(URDF / "serial-y-x-z.urdf").replace(springs=[Spring("strut", law, route=route)], name="helped")


def labels(ax):
    return {handle.get_label(): handle for handle in ax.lines + list(ax.patches)}


def test_curves_mark_where_data_lack(exo):
    angles = np.array([0.0, 20.0, 60.0, 90.0])
    answer = exo.reaction(exo.pose(angles))
    assert answer.status.tolist() == ["not_evaluated", "not_evaluated", "ok", "ok"]
    for ax in answer.plot(along=angles, label="flexion, °").axes[:2]:
        found = labels(ax)
        assert "near singular" not in found
        np.testing.assert_array_equal(found[LABEL].get_xdata(), [0.0, 20.0])
    held = exo.reaction(exo.pose(angles[2:])).plot(along=angles[2:], label="flexion, °")
    assert LABEL not in labels(held.axes[0])


def test_a_single_pose_and_a_page_say_why(exo, tmp_path, capsys):
    figure = exo.reaction(exo.pose(10.0)).plot()
    texts = " ".join(text.get_text() for text in [*figure.texts, figure._suptitle])
    assert "No forces: the pose is not evaluated" in texts
    page, file = tmp_path / "page.html", exo.to_urdf(tmp_path)
    assert main(["view", str(file), "--flexion", "10", "--plot", str(page)]) == 0
    said = 'spring "strut" has no data at 0.206 m (table 0.285 to 0.9 m)'
    assert said in " ".join(capsys.readouterr().out.split())
    scene = exo.view()
    for angle, headline in ((10.0, "No solution: not evaluated"), (90.0, "")):
        answer = scene.show(exo.pose(angle))
        panel = scene._stage.panel("numbers")
        assert panel.get("headline", "") == headline
        assert answer.verdict in [note["text"] for note in panel["notes"]]


@pytest.mark.full
def test_a_detailed_comparison_reports_them_apart(exo):
    """Held and singular shares are without them; what needs no spring is as without one."""
    poses = exo.pose([20.0, 90.0])
    bare = exo.replace(springs=[], name="bare")
    table = compare(exo, bare, poses=poses, detailed=True)
    assert table["not_evaluated"].tolist() == [0.5, 0.0]
    assert table["holdable"].tolist() == [0.5, 1.0]
    for name in ("singular", "median_margin", "reach", "stroke_deg", "follows_10_mm"):
        np.testing.assert_array_equal(table[name][0], table[name][1], err_msg=name)
    assert any(text.startswith("In row 1 a spring has no data in some of the poses") for text in table.cautions)
    ax = table.plot().axes[0]
    bars = next(each for each in ax.containers if each.get_label() == LABEL)
    # The best stands first, which holds both poses.
    assert [bar.get_width() for bar in bars] == [0.0, 50.0]
    assert [bar.get_x() for bar in bars] == [100.0, 50.0]
    plain = StudyTable([{name: table[name][1] for name in table}] * 2).plot().axes[0]
    assert LABEL not in [each.get_label() for each in plain.containers]
