"""How often a fault is brought about: twenty times, and a few times in CI's short form."""

import os

TIMES = 3 if os.environ.get("CI") else 20
