"""Processes of our own and the datagrams between them."""
