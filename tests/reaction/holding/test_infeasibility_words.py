"""What is missing in a pose that cannot be held, word by word."""

import numpy as np

from exo_pin.reaction import Infeasibility


def test_the_explanation_word_by_word():
    nan = np.nan
    one = {
        "infeasible": np.array([True, False]),
        "closest_actuator_forces": np.array([[-0.04, 20.0, 5.0], [nan] * 3]),
        "closest_constraint_forces": np.zeros((2, 3)),
        "closest_shoulder_force": np.zeros((2, 3)),
        "missing_wrench": np.array([[0.0, 0.0, 0.0, 0.0, 0.3, -0.4], [nan] * 6]),
        "direction": np.zeros((2, 6)),
        "required": np.ones(2),
        "available": np.zeros(2),
        "valid_up_to": np.ones(2),
        "blocking": np.array([[-1, 1, 0], [0, 0, 0]], dtype=np.int8),
        "relief": np.array([[np.inf, 3.21, np.inf], [nan] * 3]),
        "drive_units": tuple((f"limb {i}", "N") for i in (1, 2, 3)),
    }

    def told(index=0, **other):
        return Infeasibility(**(one | {key: np.array([value, value]) for key, value in other.items()})).explain(index)

    missing = "With the best forces within the limits, 0.50 N m about (0.00, 0.60, -0.80) is missing."
    limbs = (
        "Limb 1 is at its least force, 0.0 N. "
        "Limb 2 is at its greatest force, 20.0 N (a limit 3.2 N wider would make the pose feasible)."
    )
    others = "Widening one of the others alone does not make the pose feasible."
    assert told() == f"{missing} {limbs} {others}"
    assert told(1) == "This pose can be held."
    assert told(relief=[1.0, 3.21, np.inf]).endswith("(a limit 3.2 N wider would make the pose feasible).")
    assert "Widening one of these limits alone" in told(relief=[np.inf] * 3)
    assert "Widening this limit alone" in told(relief=[np.inf] * 3, blocking=[0, 1, 0])
    assert told(blocking=[0, 0, 0]) == missing
    force = told(missing_wrench=[0.0, 3.0, 4.0, 0.0, 0.0, 1e-10])
    assert force.startswith("With the best forces within the limits, 5.0 N of force is missing.")
    both = told(missing_wrench=[0.0, 3.0, 4.0, 0.0, 0.0, 2e-9])
    assert "0.00 N m about (0.00, 0.00, 1.00) and 5.0 N of force is missing." in both
