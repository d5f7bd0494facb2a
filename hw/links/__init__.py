"""How processes of one robot talk: children that live as long as we do, and datagrams."""
