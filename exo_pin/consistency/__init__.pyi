from .checks import CHAIN_CHECKS as CHAIN_CHECKS
from .checks import WRIST_CHECKS as WRIST_CHECKS
from .checks import check as check
from .checks import check_chain as check_chain
from .report import Finding as Finding
from .report import Report as Report
