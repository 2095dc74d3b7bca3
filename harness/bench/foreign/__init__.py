"""Streams of real devices through `validate` and `characterize`, beside OpenCV, evo, allantools and a grid search."""
