"""Cases that pass through every byte: a bench and what it conceals are drawn, and a campaign is run on it in virtual
time by whoever is handed the bench; out come the recording as the rig wrote it and, apart from it, the sealed truth.
"""
