"""Section 5 of the paper: its conditions, figures, statistics and claims."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
