"""The user's motion, estimated and predicted, and the states that watch signals."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
