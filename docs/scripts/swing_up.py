"""Swing up an arm of four bars that its motor is too weak to lift, by Crocoddyl in the one independent coordinate.

::

    pip install '.[optimal-control,robots]'
    python docs/scripts/swing_up.py

Crank and follower turn about two pivots 0.1 m apart and carry a rod between their ends. Held out level, the arm needs
2.7 N m at the crank; its motor has 1 N m.
"""

import sys

import crocoddyl
import numpy as np

from exo_pin.chain import ClosedChain, action_model

#: Limit of the motor, N m, time between two samples, s, and how many there are.
TORQUE, STEP, STEPS = 1.0, 0.03, 80
MOTOR = ("crank",)


def arm():
    """The arm in the vertical plane x, z; angles about y, rad, a crank at zero is level."""

    def link(name, at, length, inner=""):
        inertia = 0.5 * length**2 / 12
        inertial = f'<inertial mass="0.5" pos="{length / 2} 0 0" diaginertia="1e-5 {inertia} {inertia}"/>'
        inertial += f'<site name="{name}_end" pos="{length} 0 0"/>'
        return f'<body name="{name}" pos="{at} 0 0"><joint name="{name}" axis="0 1 0"/>{inertial}{inner}</body>'

    bodies = link("crank", 0.0, 0.3, link("rod", 0.3, 0.25)) + link("follower", 0.1, 0.3)
    loop = '<connect site1="rod_end" site2="follower_end"/>'
    return ClosedChain.from_mjcf(
        f'<mujoco><compiler angle="radian"/><worldbody>{bodies}</worldbody><equality>{loop}</equality></mujoco>'
    )


def swing_up(iterations=200):
    """Solve it: action model, states (k, 2), efforts (k, 1), goal, and whether the solver has converged."""
    chain = arm()
    model = action_model(chain, chain.close([np.pi / 2, 0.0, np.pi / 2]), MOTOR, MOTOR, crocoddyl.CostModelSum)
    # Where the motor holds the arm without effort, below and above.
    angles = np.linspace(0.0, 2.0 * np.pi, 181)
    held = [chain.inverse_dynamics(model.configuration([angle]), actuated=MOTOR).tau[0] for angle in angles]
    balanced = angles[:-1][np.diff(np.sign(held)) != 0.0]
    start, goal = np.array([balanced[0], 0.0]), np.array([balanced[1], 0.0])

    def costs(goal_weight, effort_weight):
        def made(state, count):
            found = crocoddyl.CostModelSum(state, count)
            weights = crocoddyl.ActivationModelWeightedQuad(np.array([1.0, 0.1]))
            left = crocoddyl.CostModelResidual(state, weights, crocoddyl.ResidualModelState(state, goal, count))
            found.addCost("goal", left, goal_weight)
            effort = crocoddyl.CostModelResidual(state, crocoddyl.ResidualModelControl(state, count))
            found.addCost("effort", effort, effort_weight)
            return found

        return made

    actions = []
    for weights, step in (((0.0, 0.01), STEP), ((1000.0, 0.0), 0.0)):
        action = action_model(chain, model.start, MOTOR, MOTOR, costs(*weights))
        actions.append(crocoddyl.IntegratedActionModelEuler(action, step))
        actions[-1].u_lb, actions[-1].u_ub = np.array([-TORQUE]), np.array([TORQUE])
    running, last = actions
    solver = crocoddyl.SolverBoxFDDP(crocoddyl.ShootingProblem(start, [running] * STEPS, last))
    pushed = 0.5 * np.sin(6.0 * STEP * np.arange(STEPS))[:, None]
    done = solver.solve([start] * (STEPS + 1), list(pushed), iterations, False, 0.1)
    return model, np.array(solver.xs), np.array(solver.us), goal, done


def main():
    """Print how the swing ends."""
    model, states, efforts, goal, done = swing_up()
    level = model.chain.inverse_dynamics(model.configuration([0.0]), actuated=MOTOR).tau[0]
    sys.stdout.write(f"{'converged' if done else 'not converged'}: {np.abs(efforts).max():.2f} N m at most, ")
    sys.stdout.write(f"{abs(level):.2f} to hold the arm level\n")
    first, end, asked = np.degrees([states[0, 0], states[-1, 0], goal[0]])
    sys.stdout.write(f"crank from {first:.1f}° to {end:.2f}°, asked {asked:.2f}°\n")


if __name__ == "__main__":
    main()
