"""How a record is written in bytes: header, schemas, messages, chunks, seal."""

from engine.faces import face

__getattr__, __dir__ = face(__name__)
