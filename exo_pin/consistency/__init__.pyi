from .report import Finding as Finding
from .report import Report as Report
from .robots import CHAIN_CHECKS as CHAIN_CHECKS
from .robots import check_chain as check_chain
from .robots import check_device as check_device
from .wrists import CHECKS as CHECKS
from .wrists import check as check
from .wrists import run_check as run_check
