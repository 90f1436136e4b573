"""Tables of a scene file: the keys of each, and what is made of them."""
