"""The catalogue: from folders of recordings, ledgers and results to what `rig list`, `show` and `compare-fits` tell of
them. The files are the truth; the SQLite index beside them may be deleted at any time.
"""
