"""Could a contact or a failed Escape have been avoided: a search apart from the behaviours."""
