"""From recordings of one thruster to its model (C V|V|, larger ones, the rotor); from several to a comparison."""
