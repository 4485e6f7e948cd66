from .devices import check as check
from .report import Finding as Finding
from .report import Report as Report
from .robots import CHAIN_CHECKS as CHAIN_CHECKS
from .robots import check_chain as check_chain
from .wrists import WRIST_CHECKS as WRIST_CHECKS
