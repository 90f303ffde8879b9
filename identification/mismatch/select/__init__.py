"""From the catalogue and the runs to the model that earns its terms: screening, forward selection, rivals exchanged."""
