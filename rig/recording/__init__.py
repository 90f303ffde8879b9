"""From rows and facts to files that survive a crash: the recorder process, its link, the ledger."""
