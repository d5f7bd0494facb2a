"""What precision is worth, and which disturbances are borne: campaigns that vary one thing each."""
