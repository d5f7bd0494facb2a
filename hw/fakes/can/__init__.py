"""Fake CAN nodes: wheel drives and a bumper board on a virtual bus."""
