"""Reads, checks, draws and runs state charts; knows no robot."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
