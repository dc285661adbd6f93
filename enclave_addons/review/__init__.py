"""Questions that a reviewer asks of a plan, answered without running anything. Performs no I/O.

document.py           a plan, fresh or read back from the dry run's JSON, as what a review needs of it
changes.py            two plans -> what was added, removed and moved, and whether rights grew
information_flow.py   a plan -> which enclave can influence which, over any number of hops
similarity.py         a plan -> enclaves worth merging or splitting, with what that costs
signed.py             a plan's permissions as they come back from being signed, to compare with a keystore
checks/               a plan -> findings, each with a code
"""
