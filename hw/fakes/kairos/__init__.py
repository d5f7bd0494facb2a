"""A fake RB-KAIROS behind a rosbridge server."""
