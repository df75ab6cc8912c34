"""The M600, a hexacopter: its skillset, one file per skill manager, and the bridge to its functional layer."""
