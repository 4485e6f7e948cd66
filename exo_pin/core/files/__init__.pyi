from .atomic import write_bytes as write_bytes
from .atomic import write_text as write_text
from .figures import write_figure as write_figure
from .targets import is_stream as is_stream
