"""How a record is written in bytes: header, schemas, messages, chunks, seal."""
