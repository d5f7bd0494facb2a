"""Reading a record: replay, comparison, its person and its plant."""
