"""Peers that speak the devices' protocols and misbehave on purpose; no driver shares their code."""
