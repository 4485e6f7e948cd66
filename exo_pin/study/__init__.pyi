from .parameter_sweep import FIGURES as FIGURES
from .parameter_sweep import adl_box as adl_box
from .parameter_sweep import compare as compare
from .parameter_sweep import evaluate as evaluate
from .parameter_sweep import sweep as sweep
from .study_table import StudyTable as StudyTable
from .study_table import non_dominated as non_dominated
