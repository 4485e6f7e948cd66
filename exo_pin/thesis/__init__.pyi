from .all_rows import ledger as ledger
from .row_tables import condensed as condensed
from .row_tables import ledger_table as ledger_table
from .rows import Row as Row
from .rows import Verdict as Verdict
from .rows import compare as compare
