"""The blind proof: the simulated world conceals physics in recordings, the diagnosis answers, both are put together.

Three kinds of process that share nothing but files: `python -m sim_devices conceal` writes recordings and, apart from
them, the sealed truth (rig may not import sim_devices); `python -m rig.blind.answering` opens recordings only, and
refuses to open anything else of the store; the process that keeps the score joins truth and answers.

    design     what is asked: cells, jobs, orders, in an interleaved order (pure)
    store      the folder of the proof
    workers    pairs of processes, a time limit for each answer
    scoring    one answer beside its truth, rates with intervals beside the goals (pure)
"""
