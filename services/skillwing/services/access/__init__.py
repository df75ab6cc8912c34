"""Access to a robot: certificates, the policy of a router, and the words for those whom it denies.

`policy.py`, `zenoh_rules.py` and `exposure.py` are pure. `key_store.py` and `identity_files.py` read and write files.
"""
