"""Equilibrium of arm and limbs as affine functions of the tensions f and the side forces g, for poses of shape (...).

    M_f f + M_g g = m                    moments of the limbs on the arm about the anatomical centre O
    F_s = s_0 + S_f f + S_g g            force of the shoulder on the arm
    λ_i = w_0i + w_fi f_i + w_gi g_i     wrench of the torso on limb i; part of it carries and moves the limb itself

Two producers fill it: :mod:`exo_pin.wrist_chain.equilibrium` through Pinocchio, where the device's centre is the
shoulder's and M_g = 0, and :mod:`exo_pin.wrist.forces.displaced` in closed form, where it is not.

With springs of stiffness k_i along the side wrenches and K_s at the shoulder, the displacement δ of the joint's centre
strains limb i by S_gi · δ + misfit_i, so that

    g_i = k_i (S_gi · δ + misfit_i)      F_s = -K_s δ

A shoulder without a stiffness is rigid: δ = 0, and F_s is what balances the rest. The pose is held by the actuators, so
f follows from the moment balance and not from a stiffness.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.validation import FloatArray

#: Condition number of the elastic equations above which a direction has no stiffness of shoulder or limbs.
LOOSE = 1e12


class AffineState(NamedTuple):
    """Forces of poses of shape (...) as affine functions of f and g, base frame, moments about O.

    Attributes
    ----------
    moment_of_f, moment_of_g : ndarray
        M_f and M_g, shape (..., 3, n), m.
    moment : ndarray
        m, shape (..., 3), N m.
    shoulder : ndarray
        s_0, shape (..., 3), N.
    shoulder_of_f, shoulder_of_g : ndarray
        S_f and S_g, shape (..., 3, n), dimensionless. Zero for the g of an SPS limb.
    closure : ndarray
        w_0, shape (..., n, 6), force in N and moment in N m.
    closure_of_f, closure_of_g : ndarray
        Its change per N of f_i and of g_i, shape (..., n, 6).
    limb_share : ndarray
        Shape (..., n, 6): part of λ_i that carries and moves the limb itself; the rest acts on the arm.
    """

    moment_of_f: FloatArray
    moment_of_g: FloatArray
    moment: FloatArray
    shoulder: FloatArray
    shoulder_of_f: FloatArray
    shoulder_of_g: FloatArray
    closure: FloatArray
    closure_of_f: FloatArray
    closure_of_g: FloatArray
    limb_share: FloatArray

    @classmethod
    def of_closures(
        cls,
        closure: FloatArray,
        closure_of_f: FloatArray,
        closure_of_g: FloatArray,
        limb_share: FloatArray,
        wrench: FloatArray,
    ) -> AffineState:
        """The state that follows from the closure wrenches.

        Parameters
        ----------
        closure, closure_of_f, closure_of_g, limb_share : ndarray
            As the attributes.
        wrench : ndarray
            Shape (..., 6): total wrench of shoulder and closures on arm and limbs.
        """
        carried = wrench - closure.sum(axis=-2)
        of_f, of_g = np.swapaxes(closure_of_f, -1, -2), np.swapaxes(closure_of_g, -1, -2)
        return cls(
            of_f[..., 3:, :],
            of_g[..., 3:, :],
            carried[..., 3:],
            carried[..., :3],
            -of_f[..., :3, :],
            -of_g[..., :3, :],
            closure,
            closure_of_f,
            closure_of_g,
            limb_share,
        )

    def row(self, k: int) -> AffineState:
        """Pose k of a stack."""
        return AffineState(*(part[k] for part in self))

    def shoulder_force(self, f: FloatArray, g: FloatArray) -> FloatArray:
        """F_s, shape (..., 3), N.

        Source: thesis (D-27), (D-28), (D-29), (D-30).
        """
        return np.asarray(
            self.shoulder + (self.shoulder_of_f @ f[..., None] + self.shoulder_of_g @ g[..., None])[..., 0]
        )

    def closures(self, f: FloatArray, g: FloatArray) -> FloatArray:
        """λ, shape (..., n, 6)."""
        return self.closure + f[..., None] * self.closure_of_f + g[..., None] * self.closure_of_g

    def wrenches(self, f: FloatArray, g: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Wrenches of the limbs on the arm and on the torso, shape (..., n, 6) each."""
        closure = self.closures(f, g)
        return closure - self.limb_share, -closure

    def on_arm_of(self, f: FloatArray, g: FloatArray) -> FloatArray:
        """Change of those on the arm with f and g."""
        return f[..., None] * self.closure_of_f + g[..., None] * self.closure_of_g

    def following(self, stiffness: FloatArray | None, limbs: FloatArray, misfit: FloatArray) -> Follower:
        """The state with side forces that follow the stiffness, for one pose; see :class:`Follower`.

        Parameters
        ----------
        stiffness : ndarray
            K_s, shape (3, 3), N/m; together with the limbs' it must resist every direction. None of a rigid shoulder.
        limbs, misfit : ndarray
            k_i, N/m, and misfit, m, shape (n,).
        """
        S, pushed = self.shoulder_of_g, self.shoulder_of_g * limbs
        flexibility = np.zeros((3, 3)) if stiffness is None else np.linalg.inv(stiffness + pushed @ S.T)
        push = pushed.T @ flexibility
        of_f = -push @ self.shoulder_of_f
        at_zero = limbs * misfit - push @ (self.shoulder + pushed @ misfit)
        state = self._replace(
            moment_of_f=self.moment_of_f + self.moment_of_g @ of_f,
            moment=self.moment - self.moment_of_g @ at_zero,
            shoulder=self.shoulder + S @ at_zero,
            shoulder_of_f=self.shoulder_of_f + S @ of_f,
        )
        return Follower(state, at_zero, of_f)


class Follower(NamedTuple):
    """One pose whose side forces follow the tensions.

    Attributes
    ----------
    state : AffineState
        Moments and F_s in terms of f alone; closure wrenches as in the original state.
    g, g_of_f : ndarray
        g = g + g_of_f f, shapes (n,) in N and (n, n).
    """

    state: AffineState
    g: FloatArray
    g_of_f: FloatArray


class BalancedTensions(NamedTuple):
    """N poses with the tensions solved from the moment balance: f = f0 + f_of_g g + self_stress y, any g and y.

    Attributes
    ----------
    f : ndarray
        f0, shape (N, n), N, of least norm.
    f_of_g, self_stress : ndarray
        Shapes (N, n, n), and (N, n, n - 3) with orthonormal columns.
    shoulder, shoulder_of_g, shoulder_of_stress : ndarray
        F_s at g = y = 0, shape (N, 3), N, and its change, shapes (N, 3, n) and (N, 3, n - 3).
    singular_values : ndarray
        Of M_f, shape (N, 3), m.
    """

    f: FloatArray
    f_of_g: FloatArray
    self_stress: FloatArray
    shoulder: FloatArray
    shoulder_of_g: FloatArray
    shoulder_of_stress: FloatArray
    singular_values: FloatArray

    @classmethod
    def of(cls, state: AffineState) -> BalancedTensions:
        """Solve a stack of N poses; directions without moment are left out.

        Source: thesis (D-20), (D-21), (D-22).
        """
        U, values, Vt = np.linalg.svd(state.moment_of_f)
        inverse = np.divide(1.0, values, out=np.zeros_like(values), where=values > 0.0)
        # Tensions of least norm that make a moment, shape (N, n, 3).
        tensions = (np.swapaxes(Vt[:, :3], 1, 2) * inverse[:, None]) @ np.swapaxes(U, 1, 2)
        stress = np.swapaxes(Vt[:, 3:], 1, 2)
        f = (tensions @ state.moment[..., None])[..., 0]
        # One refinement: near the singular surface f is large, and its rounding would be left over as moment.
        f = f + (tensions @ (state.moment - (state.moment_of_f @ f[..., None])[..., 0])[..., None])[..., 0]
        f_of_g = -tensions @ state.moment_of_g
        return cls(
            f,
            f_of_g,
            stress,
            state.shoulder + (state.shoulder_of_f @ f[..., None])[..., 0],
            state.shoulder_of_g + state.shoulder_of_f @ f_of_g,
            state.shoulder_of_f @ stress,
            values,
        )

    def elastic_system(
        self, sides: FloatArray, stiffness: FloatArray, limbs: FloatArray, misfit: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """K_s + K_X and the load N of (K_s + K_X) δ = N, misfit included, y = 0.

        Parameters
        ----------
        sides : ndarray
            S_g of the state, shape (N, 3, n).
        stiffness : ndarray
            K_s, shape (3, 3), N/m.
        limbs, misfit : ndarray
            k_i, N/m, and misfit, m, shape (N, n).

        Returns
        -------
        system, load : ndarray
            Shapes (N, 3, 3), N/m, and (N, 3), N.
        """
        pushed = self.shoulder_of_g * limbs[:, None, :]
        return stiffness + pushed @ np.swapaxes(sides, 1, 2), -self.shoulder - (pushed @ misfit[..., None])[..., 0]

    def elastic(
        self, sides: FloatArray, stiffness: FloatArray | None, limbs: FloatArray, misfit: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Side forces, shape (N, n), N, and displacement δ, shape (N, 3), m, by stiffness, y = 0.

        Parameters are those of :meth:`elastic_system`; no stiffness is a rigid shoulder. NaN where a direction has no
        stiffness of shoulder or limbs.
        """
        delta = np.zeros(self.shoulder.shape)
        if stiffness is not None:
            system, load = self.elastic_system(sides, stiffness, limbs, misfit)
            firm = np.linalg.cond(system) < LOOSE
            delta = np.full_like(load, np.nan)
            delta[firm] = np.linalg.solve(system[firm], load[firm][..., None])[..., 0]
        return limbs * ((np.swapaxes(sides, 1, 2) @ delta[..., None])[..., 0] + misfit), delta


#: State, tensions, stiffness and misfit of the limbs along their side wrenches, shape (N, n), N/m and m; then status,
#: margin and determinant, shape (N,): what every producer gives of N poses.
EquilibriumParts = tuple[
    AffineState, BalancedTensions, FloatArray, FloatArray, NDArray[np.int8], FloatArray, FloatArray
]
