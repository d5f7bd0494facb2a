"""The program: catalogue, wiring and command line."""
