from .all_rows import ledger as ledger
from .rows import Row as Row
from .rows import Verdict as Verdict
from .rows import compare as compare
from .rows import condensed as condensed
from .rows import ledger_table as ledger_table
