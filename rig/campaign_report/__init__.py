"""From a campaign's folder to the one page that tells all of it, which is kept, printed and signed (`rig report`)."""
