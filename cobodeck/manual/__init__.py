"""Reference pages, made from what states, signals, charts and files say of themselves."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
