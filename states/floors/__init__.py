"""How much of a floor a robot can use: areas, closed passages, user poses."""
