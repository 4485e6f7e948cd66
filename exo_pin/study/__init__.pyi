from .evaluation import compare as compare
from .evaluation import evaluate as evaluate
from .figure_words import FIGURES as FIGURES
from .parameter_sweep import adl_box as adl_box
from .parameter_sweep import sweep as sweep
from .ranks import non_dominated as non_dominated
from .study_table import StudyTable as StudyTable
