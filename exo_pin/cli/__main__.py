"""``python -m exo_pin.cli``."""

import sys

from . import main

sys.exit(main())
