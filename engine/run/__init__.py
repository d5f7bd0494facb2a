"""One run of a chart: ticks, entering and leaving, waiting, the trace."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
