"""Drivers of devices behind a rosbridge server."""
