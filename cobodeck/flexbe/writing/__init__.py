"""The files of a project that works on its own: charts, states, a test, a list of work."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
