"""How well an effect can be seen: a case goes in; the sigma of an oracle, or what a rival would leave, comes out."""
