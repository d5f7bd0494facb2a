"""Run time against error: what `cobodeck bench` measures."""
