"""From symbolic CasADi models to kernels: the models supply the derivatives, numba runs them.

A model module (for example `glassslam.posegraph.model`) has a function `functions()` that builds
`casadi.Function` objects of SX expressions. `translate` writes each as Python source that numba
compiles and inlines, and `render_module` gathers them; `tools/generate_kernels.py` puts the result
beside the model in the committed file `_generated.py`. So a run needs no CasADi for its inner loops
and translates nothing, and a test compares the committed file with what the model gives today.
"""

from glassslam.symbolic.translate import render_module, translate

__all__ = ["render_module", "translate"]
