"""What counts as one in a search, which of two designs is better, and when the contact force is exact, by hand."""

from types import SimpleNamespace

import pytest

from exo_pin.workspace.optimisation.merit import Evaluation, Merit

pytestmark = pytest.mark.usefixtures("plain")


def test_contact_force_is_exact_in_the_best_third_of_a_generation():
    """The others get what the surrogate misses in these on average."""
    asked = []

    def evaluate(point, weights, is_exact=True):
        asked.append((float(point), is_exact))
        return Evaluation(point + (10.0 + point if is_exact else 0.0), {})

    fake = SimpleNamespace(contact=object(), evaluate=evaluate)
    points = [5.0, 1.0, 4.0, 2.0, 3.0, 6.0, 7.0]
    found = Merit.generation(fake, points, {"contact_force": 1.0})
    exact = {1.0: 12.0, 2.0: 14.0, 3.0: 16.0}
    assert found == [exact.get(point, point + 12.0) for point in points]
    assert [point for point, is_exact in asked if is_exact] == [1.0, 2.0, 3.0]
    assert Merit.generation(fake, points, {}) == [10.0 + 2.0 * point for point in points]
