"""The program: catalogue, wiring and command line."""

from cobodeck import shadows

_hidden = shadows.shadows(["engine"])
if _hidden:  # everything needs the engine, whatever could explain the failure too
    raise ImportError(shadows.explained(_hidden))
