"""Reads, checks, draws and runs state charts; knows no robot."""
