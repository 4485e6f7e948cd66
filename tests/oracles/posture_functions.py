"""A point on two slides, and functions of where it is, for searches whose steps are known by hand."""

import numpy as np
import pinocchio as pin

from exo_pin.chain import ClosedChain, Closure, Closures
from exo_pin.chain.postures.posture_problem import PostureProblem
from exo_pin.chain.structure.motion_axes import limits_of

INF = np.inf
NONE = np.zeros(0, dtype=int)


def sliders(closures=(), low=(-INF, -INF), high=(INF, INF)):
    """A point on two slides along x and z."""
    model = pin.Model()
    for k, joint in enumerate((pin.JointModelPX(), pin.JointModelPZ())):
        model.addJoint(k, joint, pin.SE3.Identity(), "xz"[k])
        model.appendBodyToJoint(k + 1, pin.Inertia(1.0, np.zeros(3), np.eye(3)), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"body_{k}", k + 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model.lowerPositionLimit, model.upperPositionLimit = np.array(low), np.array(high)
    return ClosedChain(model, Closures("sliders", closures=tuple(closures)))._state


class Function:
    """An objective by its gradient; values that are ``share`` of what the gradient promises, and a record of trials."""

    def __init__(self, value, gradient, scale=1.0):
        self._value, self._gradient, self._scale, self.tried = value, gradient, scale, []

    def value(self, q):
        self.tried.append(q.copy())
        return self._value(q)

    def gradient(self, q):
        return self._gradient(q)

    def scale(self, q):
        return self._scale


def bowl(target, share=1.0, curvatures=(1.0, 1.0), scale=1.0):
    """A sum of squares."""
    c, target = np.array(curvatures), np.array(target)
    return Function(lambda q: 0.5 * share * float(c @ (q - target) ** 2), lambda q: c * (q - target), scale)


def problem(objective, state=None, held=NONE, limited=False):
    state = state or sliders()
    return PostureProblem(state, objective, held, limits_of(state.model) if limited else None, 1e-12)


def circle(radius=0.5):
    """The point on a rod about the origin."""
    rod = Closure("rod", "distance", "body_1", "universe", distance=radius)
    return sliders([rod])
