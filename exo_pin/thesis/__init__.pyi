from .all_rows import condensed as condensed
from .all_rows import ledger as ledger
from .all_rows import ledger_table as ledger_table
from .rows import Row as Row
from .rows import Verdict as Verdict
from .rows import compare as compare
