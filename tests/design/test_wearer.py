"""Who wears a device."""

import numpy as np

import exo_pin as ep


def test_persons_drawn_have_the_percentiles_of_their_source():
    persons = ep.Wearer.drawn(4000, seed=3)
    for sex, height, mass in (("female", (1.525, 1.740), (51.0, 87.0)), ("male", (1.648, 1.870), (64.0, 111.0))):
        some = [each for each in persons if each.sex == sex]
        assert len(some) == 2000
        np.testing.assert_allclose(np.percentile([each.height for each in some], [5, 95]), height, atol=0.01)
        np.testing.assert_allclose(np.percentile([each.mass for each in some], [5, 95]), mass, rtol=0.04)
    assert [each.height for each in ep.Wearer.drawn(3, seed=3)] == [each.height for each in persons[:3]]
