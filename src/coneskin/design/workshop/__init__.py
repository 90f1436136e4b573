"""What a workshop needs to build the sheets of a design: figures, guide, materials, jig."""
