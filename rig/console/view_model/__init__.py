"""From snapshots to what is shown, without a widget: the folded view, words, tables, axes, running fit. Pure."""
