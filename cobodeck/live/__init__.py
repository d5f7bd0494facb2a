"""The live page: runs, records and charts in a browser, and the tools of an operator."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
