"""The array type of the package.

Everything physical takes n poses at once; shapes stand in docstrings, units are SI and radians.
Six-vectors have the linear part before the angular part, as in pinocchio.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
