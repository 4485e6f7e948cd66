"""The checks of a device of any kind: those of its chain, and what its drives, its arm and its springs say."""

from __future__ import annotations

from ..chain import ClosedChain
from ..core.errors import ExoPinError, LoopNotClosed
from ..core.errors.checked import checked
from ..design import Arm, Mechanism
from ..device.protocol import Device
from ..device.wrist_device import as_device
from .report import Finding, Report
from .robots import check_chain, springs
from .wrists import check_wrist


@checked
def check(device: Device | Mechanism, chain: ClosedChain | None = None) -> Report:
    """Run every check on a device: of its chain, its springs, and a wrist's closed forms.

    Parameters
    ----------
    device : Device or Mechanism
        Of any kind, or the record of a wrist; without an arm the kinematic checks still run.
    chain : ClosedChain, optional
        Its chain with the arm of who wears it; as the device has it if left out.

    Returns
    -------
    Report
        A check that cannot run because of the device itself counts as failed, with the error as its evidence.

    Examples
    --------
    >>> from exo_pin.consistency import check
    >>> from exo_pin.device import ChainDevice, Route, Spring, TableLaw
    >>> strut = Route.over(("universe", [0.0, 0.0, -0.4]), ("arm", [0.0, 0.0, -0.2]))
    >>> law = TableLaw((0.3, 0.5), (-40.0, -10.0))  # m, N
    >>> device = ChainDevice.from_chain(ep.load("prototype").chain)
    >>> print(check(device.replace(springs=[Spring("strut", law, route=strut)])).findings[-1].detail)
    spring 'strut': law covers 47° to 108° of flexion, 47° to 108° of abduction
    """
    asked = as_device(device)
    held = None
    try:
        own = asked.as_chain()
        held = own.structure.rank
    except LoopNotClosed:  # as the check of the loops says
        pass
    except ExoPinError as error:
        return Report(asked.name, (Finding("chain", "fail", str(error)),))
    findings = check_chain(own.chain if chain is None else chain, held).findings
    if all(finding.outcome != "fail" for finding in findings):
        lacking = _lacking(asked.arm)
        if lacking:
            findings = (*(each for each in findings if each.name != "inertia"), Finding("inertia", "note", lacking))
        findings += (springs(own),) if own.springs else ()
    record = asked.accelerate("check")
    return Report(asked.name, findings if record is None else findings + check_wrist(record))


def _lacking(arm: Arm | None) -> str:
    """What forces need of an arm and do not have; empty if nothing."""
    if arm is None:
        return "no arm in the file: forces need one (--person 1.75,75,male)"
    return "" if arm.inertia is not None else f"{arm.mass:.4g} kg without inertia: reaction forces in motion need one"
