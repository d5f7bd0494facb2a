"""Drivers of devices behind a rosbridge server."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
