"""What an operator can do to a run: stop, pause, force, lock, replace."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
