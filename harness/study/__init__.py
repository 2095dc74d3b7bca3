"""Studies: many runs that end in a conclusion. `papers` reruns published experiments, `placement` places stations."""
