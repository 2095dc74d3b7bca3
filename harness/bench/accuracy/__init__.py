"""`harness bench accuracy`: a method against the stored errors of an earlier commit, and against today's others."""
