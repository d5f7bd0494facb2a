"""The program: catalogue, wiring and command line."""

from cobodeck import shadowed

_hidden = shadowed.shadows(["engine"])
if _hidden:  # everything needs the engine, whatever could explain the failure too
    raise ImportError(shadowed.explained(_hidden))
