"""Run time against error: what `cobodeck bench` measures."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
