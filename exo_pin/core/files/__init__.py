"""Writing files: whole or not at all, and into pipes and devices as they are."""

from .atomic import write_bytes, write_text
from .column_files import write_columns
from .figures import write_figure
from .targets import is_stream
from .writable import require_ending, require_folder, require_writable

__all__ = [
    "is_stream",
    "require_ending",
    "require_folder",
    "require_writable",
    "write_bytes",
    "write_columns",
    "write_figure",
    "write_text",
]
