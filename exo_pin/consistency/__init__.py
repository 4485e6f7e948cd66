"""Does a mechanism do what its description says? Checks for the user's own designs as for the published ones."""

from .report import Finding, Report
from .robots import CHAIN_CHECKS, check_chain
from .wrists import CHECKS, check, run_check

__all__ = ["CHAIN_CHECKS", "CHECKS", "Finding", "Report", "check", "check_chain", "run_check"]
