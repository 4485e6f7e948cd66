"""One page in the browser that asks the package's questions: ``exo-pin app``. A program, without names for scripts."""
