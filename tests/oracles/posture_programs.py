"""Postures by SciPy's SLSQP in the coordinates of the open tree, from many random starts."""

import numpy as np
import pinocchio as pin
import scipy.optimize

#: Largest residual of the loops in an answer of SciPy that counts, m and rad.
CLOSED = 1e-9


def weighted_error(model, tasks, q):
    """Weighted errors, from Pinocchio's placements: tasks are (kind, what, target, costs)."""
    data, found = model.createData(), []
    for kind, what, target, costs in tasks:
        if kind == "frame":
            pin.framesForwardKinematics(model, data, q)
            place = data.oMf[model.getFrameId(what)]
            back = target.rotation.T
            error = np.concatenate([back @ (place.translation - target.translation), pin.log3(back @ place.rotation)])
        elif kind == "com":
            error = pin.centerOfMass(model, data, q) - target
        else:
            error = pin.difference(model, target, q)
        found.append(np.asarray(costs) * error)
    return np.concatenate(found)


def least_by_scipy(chain, value, q0, starts, seed=0, held=(), limited=True, spread=1.0):
    """The least value(q) on closed loops of all starts, or infinity.

    The first start is ``q0``, the others are up to ``spread`` half turns and characteristic lengths away. Redundant
    rows of the loops are taken out by the row space at ``q0``, which serves loops whose redundancy does not turn with
    the configuration; an answer whose loops are open does not count.
    """
    model, rng = chain.model, np.random.default_rng(seed)
    U, sizes, _ = np.linalg.svd(chain.constraint_jacobian(q0))
    rows = U[:, : np.count_nonzero(sizes > 1e-9 * sizes.max(initial=1.0))].T
    low, high = np.full(model.nv, -np.inf), np.full(model.nv, np.inf)
    for joint in range(1, model.njoints):
        if model.nqs[joint] == model.nvs[joint] and limited:
            q, v = (slice(i[joint], i[joint] + model.nvs[joint]) for i in (model.idx_qs, model.idx_vs))
            low[v], high[v] = model.lowerPositionLimit[q] - q0[q], model.upperPositionLimit[q] - q0[q]
    fixed = np.concatenate([np.zeros(0, int), *(np.arange(model.nv)[chain.velocity_slice(name)] for name in held)])
    low[fixed] = high[fixed] = 0.0
    reach = np.where(chain.metres, chain.characteristic_length, np.pi)
    best = np.inf
    for start in range(starts):
        x = np.clip(rng.uniform(-reach, reach) * (start > 0) * (spread if start % 2 else 0.2 * spread), low, high)
        try:
            found = scipy.optimize.minimize(
                lambda x: value(pin.integrate(model, q0, x)),
                x,
                method="SLSQP",
                bounds=list(zip(low, high, strict=True)),
                constraints={"type": "eq", "fun": lambda x: rows @ chain.residual(pin.integrate(model, q0, x))},
                options={"maxiter": 300, "ftol": 1e-15},
            )
        except ValueError:
            continue
        q = pin.integrate(model, q0, found.x)
        inside = (found.x >= low - 1e-12).all() and (found.x <= high + 1e-12).all()
        if inside and np.abs(chain.residual(q)).max(initial=0.0) <= CLOSED:
            best = min(best, float(value(q)))
    return best
