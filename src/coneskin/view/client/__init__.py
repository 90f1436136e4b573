"""Client that a page is served: what of viser's is changed before a browser gets it."""
