"""Tests run with one thread for matrix products, as the command line does: small ones are six times slower on many."""

import os

os.environ.update(dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
