"""Trust in the simulation: a measured unit, its validation against a reference, and the ranks of methods on both."""
