"""The safety chain in front of the wheels, and the guarded base that drives behind it."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
