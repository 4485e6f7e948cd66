"""Small linear algebra and convex programs, compiled where they run in sweeps.

==================================== ========================================================================
program                              where it is solved
==================================== ========================================================================
least |c + G z| of three components, :mod:`.bounded.box_program`, compiled: any number of variables, each
z in a box, then the shortest z      within its own bounds
least |c + G z| of three components, :mod:`.bounded.polytope_program`, compiled: at most three unknowns, any
low <= f + N z <= high               number of limits on sums of them
least |E z - d|, equalities, box     :mod:`.quadratic`, through ProxSuite: rows that are no box (a cone, |g_i| <=
and rows C z <= c                    |f_i|), objectives of any size
w = A f + c, w and f complementary   :mod:`.complementarity`: contact forces; c may have no answer (a motion that is
in a box                             blocked), which is found out
==================================== ========================================================================
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
