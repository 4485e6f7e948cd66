"""Python imports this as it starts: a changed module is changed in each process that a test starts, too."""

import os

if "EXO_PIN_MUTANT" in os.environ:
    import changed_module  # noqa: F401 - it changes what is loaded after it
