"""Child processes that end with their parent, and datagrams between processes."""
