"""Real parts: what speaks to devices. Vendor libraries are imported in here only."""
