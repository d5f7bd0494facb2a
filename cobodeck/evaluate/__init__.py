"""What a run was worth: evaluators on the true state, metrics, figures."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
