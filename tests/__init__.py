"""Tests run with one thread for matrix products, as the command line does: on many, small ones take six times longer."""

import os

for _variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")
