"""What precision is worth, and which disturbances are borne: campaigns that vary one thing each."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
