"""Logs of MRPT: rawlogs and simplemaps."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
