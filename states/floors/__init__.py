"""How much of a floor a robot can use."""
