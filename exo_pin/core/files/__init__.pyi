from .atomic import write_bytes as write_bytes
from .atomic import write_text as write_text
from .csv_tables import write_columns as write_columns
from .figures import write_figure as write_figure
from .targets import is_stream as is_stream
from .targets import require_ending as require_ending
from .targets import require_folder as require_folder
from .targets import require_writable as require_writable
