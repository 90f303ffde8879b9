"""From bench and campaign files (TOML) to frozen plans and a bench, or one sentence of what is wrong."""
