"""Run before the cells of each page: its output must not depend on whether the kernels are compiled, or on the speed.

A compilation, or a call that takes longer than a second, otherwise shows its progress in the notebook.
"""

import vibrodrive.jit.compilation
import vibrodrive.jobs.progress

vibrodrive.jit.compilation.compilation.said_after = vibrodrive.jobs.progress.SHOWN_AFTER = 1e6
del vibrodrive
