"""Processes of our own and the datagrams between them."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
