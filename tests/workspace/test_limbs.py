"""What single limbs have to do."""

import exo_pin as ep
from exo_pin.workspace import Criteria, limb_loss


def test_loss_of_a_limb_in_words_of_the_workspace():
    exo = ep.load("four-linear-actuators")
    found = exo.workspace(12.0, Criteria(names=("forces",), least_moment_without_limb=0.0))
    lost = limb_loss(exo.mechanism, found)
    every = exo.workspace(found.poses[found.inside], Criteria(names=("limb_loss",), least_moment_without_limb=0.0))
    assert every.index <= lost["held"].min() < 1.0
    assert lost["missing_share"].max() > 0.0
    firm = exo.workspace(12.0, Criteria(names=("forces", "limb_loss"), least_moment_without_limb=0.0))
    assert limb_loss(exo.mechanism, firm)["held"].tolist() == [1.0] * 4
    assert limb_loss(exo.mechanism, firm)["missing_Nm"].tolist() == [0.0] * 4
