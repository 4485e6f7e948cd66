"""Controllers: the thesis's PI of contraction ratios, a model-based one, and whatever Python function a user writes."""
