"""Solutions of the field that share nothing with `coneskin.skin.field`: committed references, peers, 60 digits."""
