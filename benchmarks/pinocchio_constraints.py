"""Pinocchio's constrained dynamics of a chain with nothing around it, for comparison."""

import pinocchio as pin

#: Pinocchio's constraints of closures, by the rules of their types.
FORMS = {("xyz", "xyz"): "6D", ("xyz", ""): "3D", ("xyz", "xy"): "two 3D"}


def constraints_of(chain):
    """Constraints of the closures; a hinge is two points on its axis, a characteristic length apart."""
    top, found, axes = chain._state.topology, [], pin.ReferenceFrame.LOCAL
    for c, closure in enumerate(chain.closures):
        joints, a, b = top.joints[c].tolist(), top.frame(c, 0), top.frame(c, 1)
        form = FORMS[closure.kind.rules]
        kind = pin.ContactType.CONTACT_6D if form == "6D" else pin.ContactType.CONTACT_3D
        for along in (-0.5 * top.length, 0.5 * top.length) if form == "two 3D" else (0.0,):
            step = pin.SE3.Identity()
            step.translation[2] = along
            found.append(pin.RigidConstraintModel(kind, chain.model, joints[0], a * step, joints[1], b * step, axes))
    return found


def constrained_dynamics(chain):
    """A function of q, v and tau, and the vectors of constraints, with the Data and settings that it takes."""
    models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for constraint in constraints_of(chain):
        models.append(constraint)
        datas.append(constraint.createData())
    model, data, settings = chain.model, pin.Data(chain.model), pin.ProximalSettings(1e-14, 1e-10, 40)
    pin.initConstraintDynamics(model, data, models, datas)

    def solve(q, v, tau):
        return pin.constraintDynamics(model, data, q, v, tau, models, datas, settings)

    return solve, (data, models, datas, settings)
