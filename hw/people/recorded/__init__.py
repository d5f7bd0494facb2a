"""People who repeat what was recorded: walks from files, users of earlier runs."""
