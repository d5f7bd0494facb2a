"""Joint paths and their timing under joint, tool and link limits."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
