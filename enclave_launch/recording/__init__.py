"""What processes ask of librcl, recorded while they run: one recorder, used to learn, to audit and to explain.

    recorder.c       the library for LD_PRELOAD
    build.py         its build, once for each machine, and its way in             runs the compiler
    programs.py      programs that cannot be recorded, told before they start     reads their heads
    isolation.py     a launch for learning kept apart from other robots           changes our own process
    recording.py     the record of one launch, watched while it grows             reads and writes the record
    listeners.py     who hears of it meanwhile; endpoints as events of the launch
    learning.py      --learn: records and manifests in a folder                   writes them
    markers.py       --learn-parameters: a second run with marker values
    grants.py        what the plan grants, asked by what was recorded
    audit.py         --audit: what the plan would refuse, what nobody asked for
    denials.py       a refused endpoint explained: why (reasons.py), and the patch that allows it (patches.py)

Reading records is pure and has its place in ``nodl/record``.
"""
