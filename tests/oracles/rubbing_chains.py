"""Chains with dry friction and stops."""

import numpy as np
import pinocchio as pin

from exo_pin.chain import ClosedChain, Closures


def with_friction(chain, friction):
    model = chain.model.copy()
    model.upperDryFrictionLimit, model.lowerDryFrictionLimit = np.array(friction), -np.array(friction)
    return ClosedChain(model, chain.description)


def slide(angle=0.0, friction=0.0, mass=2.0, limits=(-np.inf, np.inf)):
    """A block on a slide that rises at an angle."""
    model = pin.Model()
    direction = np.array([np.cos(angle), 0.0, np.sin(angle)])
    model.addJoint(0, pin.JointModelPrismaticUnaligned(direction), pin.SE3.Identity(), "slide")
    model.appendBodyToJoint(1, pin.Inertia(mass, np.zeros(3), np.eye(3)), pin.SE3.Identity())
    model.addFrame(pin.Frame("block", 1, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    model.lowerPositionLimit, model.upperPositionLimit = np.array([limits[0]]), np.array([limits[1]])
    model.upperDryFrictionLimit, model.lowerDryFrictionLimit = np.array([friction]), np.array([-friction])
    return ClosedChain(model, Closures("slide"))
