"""Writing files: whole or not at all, and into pipes and devices as they are."""

from .atomic import write_bytes, write_text
from .figures import write_figure
from .targets import is_stream

__all__ = ["is_stream", "write_bytes", "write_figure", "write_text"]
