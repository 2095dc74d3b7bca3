"""`harness bench ranking`: do methods, and places for stations, rank alike on built-in and on real motion?"""
